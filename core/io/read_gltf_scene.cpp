#include "core/io/read_gltf_scene.h"

#include <optional>

namespace crease::gltf {
namespace {

struct PendingNode {
  std::size_t node;
  MeshInstance parent;
};

std::optional<Eigen::Affine3d> local_transform(const Json& node, const std::string& place) {
  Eigen::Matrix4d matrix;
  if (numbers_member(node, "matrix", matrix.data(), 16, place)) return Eigen::Affine3d(matrix);
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  Eigen::Vector4d rotation(0, 0, 0, 1);
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
  const bool translated = numbers_member(node, "translation", translation.data(), 3, place);
  const bool rotated = numbers_member(node, "rotation", rotation.data(), 4, place);
  const bool scaled = numbers_member(node, "scale", scale.data(), 3, place);
  if (!translated && !rotated && !scaled) return std::nullopt;
  return Eigen::Translation3d(translation) * Eigen::Quaterniond(rotation).normalized() * Eigen::Scaling(scale);
}

std::vector<double> weights_member(const Json& object, const std::string& place) {
  const Json& array = array_member(object, "weights", place);
  std::vector<double> weights(array.size());
  numbers_member(object, "weights", weights.data(), weights.size(), place);
  return weights;
}

/// The weights of a node's morph targets. Those of the node go before those of the mesh.
std::vector<double> morph_weights(const Document& document, const Json& node, std::size_t mesh,
                                  const std::string& place) {
  if (find_member(node, "weights", place) != nullptr) return weights_member(node, place);
  const std::string mesh_place = fmt::format("mesh {}", mesh);
  return weights_member(document.entry("meshes", mesh, mesh_place), mesh_place);
}

class NodeWalk {
 public:
  explicit NodeWalk(const Document& document)
      : document_(document), visited_(array_member(document.root(), "nodes", "nodes").size(), false) {}

  std::vector<MeshInstance> from(const Json& roots, const std::string& place) {
    push_children(roots, {}, place);
    while (!pending_.empty()) {
      const PendingNode next = pending_.back();
      pending_.pop_back();
      visit(next);
    }
    return std::move(instances_);
  }

 private:
  void visit(const PendingNode& pending) {
    const std::string place = fmt::format("node {}", pending.node);
    const Json& node = document_.entry("nodes", pending.node, place);
    if (visited_[pending.node]) throw Error(code::kMeshSyntax, "the node has two parents or is part of a cycle", place);
    visited_[pending.node] = true;
    MeshInstance here = pending.parent;
    if (const std::optional<Eigen::Affine3d> local = local_transform(node, place)) {
      here.transform = here.transform * *local;
      here.moved = here.moved || !local->matrix().isIdentity(0);
    }
    if (find_member(node, "mesh", place) != nullptr) {
      here.mesh = size_member(node, "mesh", place);
      const bool is_skinned = find_member(node, "skin", place) != nullptr;
      MeshInstance& instance = instances_.emplace_back(is_skinned ? MeshInstance() : here);
      instance.mesh = here.mesh;
      instance.node = pending.node;
      instance.morph_weights = morph_weights(document_, node, here.mesh, place);
    }
    push_children(array_member(node, "children", place), here, place);
  }

  void push_children(const Json& children, const MeshInstance& parent, const std::string& place) {
    for (auto child = children.rbegin(); child != children.rend(); ++child) {
      pending_.push_back({size_value(*child, "children", place), parent});
    }
  }

  const Document& document_;
  std::vector<bool> visited_;
  std::vector<PendingNode> pending_;
  std::vector<MeshInstance> instances_;
};

}  // namespace

Morphs morphs_of(const Json& primitive, const MeshInstance& instance, const std::string& place) {
  Morphs morphs;
  const Json& targets = array_member(primitive, "targets", place);
  for (std::size_t i = 0; i < std::min(targets.size(), instance.morph_weights.size()); ++i) {
    const double weight = instance.morph_weights[i];
    if (weight == 0 || find_member(targets[i], "POSITION", place) == nullptr) continue;
    morphs.emplace_back(size_member(targets[i], "POSITION", place), weight);
  }
  return morphs;
}

std::vector<MeshInstance> mesh_instances(const Document& document) {
  const Json& root = document.root();
  if (array_member(root, "scenes", "scenes").empty()) {
    std::vector<MeshInstance> all(array_member(root, "meshes", "meshes").size());
    for (std::size_t i = 0; i < all.size(); ++i) {
      all[i].mesh = i;
      all[i].morph_weights = morph_weights(document, Json::object(), i, "meshes");
    }
    return all;
  }
  const std::size_t index = size_member_or(root, "scene", 0, "scene");
  const Json& scene = document.entry("scenes", index, "scene");
  const std::string place = fmt::format("scene {}", index);
  return NodeWalk(document).from(array_member(scene, "nodes", place), place);
}

}  // namespace crease::gltf
