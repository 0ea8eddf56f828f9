#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <utility>
#include <vector>

#include "core/io/read_gltf_document.h"

namespace crease::gltf {

/// A mesh of the file with the transform of its node. That of a node with a skin does not count, as the standard says.
struct MeshInstance {
  std::size_t mesh = 0;
  std::optional<std::size_t> node{};  ///< nothing in a file without scenes
  Eigen::Affine3d transform = Eigen::Affine3d::Identity();
  bool moved = false;                 ///< whether the transform is not the identity
  std::vector<double> morph_weights;  ///< of the morph targets, by the node or else the mesh; empty for none
};

/// Morph targets of a primitive that move its vertices: the accessor of the moves, and its weight.
using Morphs = std::vector<std::pair<std::size_t, double>>;

/// Those of a primitive of the instance's mesh. \throw Error mesh_syntax with `place`
Morphs morphs_of(const Json& primitive, const MeshInstance& instance, const std::string& place);

/// The meshes of the default scene in the order of its nodes, or all meshes if the file has no scenes.
/// \throw Error mesh_syntax if the nodes do not form a tree, mesh_index_out_of_range
std::vector<MeshInstance> mesh_instances(const Document& document);

}  // namespace crease::gltf
