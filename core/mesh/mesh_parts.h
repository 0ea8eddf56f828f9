#pragma once

#include <vector>

#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease {

/// Components of a mesh that belong together, as a mesh of their own. Its vertices, faces and edges are in the order in
/// which the whole has them.
struct MeshPart {
  Mesh mesh;
  std::vector<Index> vertices, edges;  ///< their numbers in the whole
};

/// A component of so many faces tells by itself how its noise and its shape are. A smaller one is told from what is
/// alike: whether a coarse mesh has noise at all, its neighbours know better. It needs so many where nothing is alike:
/// where its edges are more than `kUnlikeEdges` times as long as those of any larger part, or as many times shorter.
inline constexpr std::size_t kFewestFacesOfPart = 4000, kFewestFacesOfUnlikePart = 500;
inline constexpr double kUnlikeEdges = 1.6;
/// Every part costs a choice. Those of meshes that take seconds have at least a sixteenth of the faces.
inline constexpr std::size_t kMostParts = 32, kMostPartsOfSeconds = 16;

/// Components that tell enough each make a part; every other one goes with the part whose edges are most alike in
/// length. The part of the component with the most faces comes first; it has the isolated vertices, too. Empty where
/// the whole is one part.
std::vector<MeshPart> parts_of(const Mesh& mesh, const Topology& topology);

}  // namespace crease
