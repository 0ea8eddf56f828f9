#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <utility>
#include <vector>

#include "core/io/read_gltf_document.h"

namespace crease::gltf {

/// Where a node with EXT_mesh_gpu_instancing has a copy of its mesh, in the frame of the node.
struct NodeCopy {
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  Eigen::Vector4d rotation = Eigen::Vector4d::UnitW();  ///< a quaternion, the real part last
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();

  Eigen::Affine3d transform() const {
    return Eigen::Translation3d(translation) * Eigen::Quaterniond(rotation).normalized() * Eigen::Scaling(scale);
  }
};

/// The copies of a node, or none if it has no such extension. \throw Error mesh_syntax, mesh_count_mismatch,
/// mesh_too_large if there are more copies than `limits` allow faces
std::vector<NodeCopy> copies_of(const Document& document, const Json& node, const DecodeLimits& limits,
                                const std::string& place);

/// A mesh of the file with the transform of its node. That of a node with a skin does not count, as the standard says.
struct MeshInstance {
  std::size_t mesh = 0;
  std::optional<std::size_t> node{};  ///< nothing in a file without scenes
  bool is_copy = false;               ///< one of copies_of its node, which come in order
  Eigen::Affine3d transform = Eigen::Affine3d::Identity();
  bool moved = false;                 ///< whether the transform is not the identity
  std::vector<double> morph_weights;  ///< of the morph targets, by the node or else the mesh; empty for none
};

/// Morph targets of a primitive that move its vertices: the accessor of the moves, and its weight.
using Morphs = std::vector<std::pair<std::size_t, double>>;

/// Those of a primitive of the instance's mesh. \throw Error mesh_syntax with `place`
Morphs morphs_of(const Json& primitive, const MeshInstance& instance, const std::string& place);

/// The meshes of the default scene in the order of its nodes, or all meshes if the file has no scenes.
/// \throw Error mesh_syntax if the nodes do not form a tree, mesh_index_out_of_range, and as copies_of
std::vector<MeshInstance> mesh_instances(const Document& document, const DecodeLimits& limits);

}  // namespace crease::gltf
