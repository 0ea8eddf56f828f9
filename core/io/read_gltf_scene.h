#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "core/io/read_gltf_document.h"

namespace crease::gltf {

/// A mesh of the file where a node puts it.
struct MeshInstance {
  std::size_t mesh = 0;
  Eigen::Affine3d transform = Eigen::Affine3d::Identity();
  bool moved = false;  ///< false: the transform is the identity
};

/// The meshes of the scene to show, in the order of its nodes; all meshes of a file without scenes.
/// \throw Error mesh_syntax (nodes that are no tree), mesh_index_out_of_range
std::vector<MeshInstance> mesh_instances(const Document& document);

}  // namespace crease::gltf
