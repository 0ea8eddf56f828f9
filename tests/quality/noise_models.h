#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease::quality {

/// The kinds of noise of the pairs. The level is the standard deviation in mean edge lengths.
enum class Noise {
  kNormal,      ///< Gaussian along the vertex normal
  kIsotropic,   ///< Gaussian on each coordinate
  kImpulsive,   ///< Gaussian along the vertex normal, on a random half of the vertices
  kSparse,      ///< the same on a random tenth of them
  kGrowing,     ///< along the vertex normal; over the longest side of the mesh the deviation grows linearly, 1 : 8
  kCorrelated,  ///< along the vertex normal, low-passed over several edges
  kDepth,       ///< of a depth camera, of what it sees of the model (tests/quality/depth_camera.h)
  kFused,       ///< of several depth cameras, whose views are fused (tests/quality/fused_scan.h)
  kMeasured,    ///< came with the pair
};

constexpr std::array<std::string_view, 9> words_of(Noise) {
  return {"normal", "isotropic", "impulsive", "sparse", "growing", "correlated", "depth", "fused", "measured"};
}

/// The word for a kind.
std::string_view word_of(Noise kind);

/// Per vertex: the direction of the sum of the area vectors around it.
std::vector<Vec3> unit_vertex_normals(const Mesh& mesh, const Topology& topology);

/// `mesh` with noise of a kind other than kDepth, kFused and kMeasured. The level of kGrowing is that in the middle of
/// the mesh, that of kCorrelated the root mean square over the vertices. The same seed gives the same mesh.
Mesh add_noise_of_kind(const Mesh& mesh, Noise kind, double level, std::uint64_t seed);

}  // namespace crease::quality
