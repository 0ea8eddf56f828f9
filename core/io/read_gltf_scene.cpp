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
  NodeCopy node_copy;
  const bool translated = numbers_member(node, "translation", node_copy.translation.data(), 3, place);
  const bool rotated = numbers_member(node, "rotation", node_copy.rotation.data(), 4, place);
  const bool scaled = numbers_member(node, "scale", node_copy.scale.data(), 3, place);
  if (!translated && !rotated && !scaled) return std::nullopt;
  return node_copy.transform();
}

/// Reads an attribute of the copies, if there is one, into the member of each.
template <typename Vector>
void read_copies(const Document& document, const Json& attributes, const char* name, Vector NodeCopy::*member,
                 std::vector<NodeCopy>& copies, const std::string& place) {
  if (find_member(attributes, name, place) == nullptr) return;
  const Accessor accessor = document.accessor(size_member(attributes, name, place), place);
  constexpr auto kComponents = static_cast<std::size_t>(Vector::RowsAtCompileTime);
  if (accessor.components != kComponents) {
    throw Error(code::kMeshSyntax, fmt::format("{} must be VEC{}", name, kComponents), accessor.place);
  }
  const std::size_t size = size_of(accessor.elements.component);
  for_each_element(accessor, [&](std::size_t element, const char* bytes) {
    for (std::size_t k = 0; k < kComponents; ++k) {
      (copies[element].*member)[static_cast<Eigen::Index>(k)] = load_number(bytes + k * size, accessor);
    }
  });
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
  NodeWalk(const Document& document, const DecodeLimits& limits)
      : document_(document), limits_(limits), visited_(array_member(document.root(), "nodes", "nodes").size(), false) {}

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
    if (find_member(node, "mesh", place) != nullptr) add_mesh(pending.node, node, here, place);
    push_children(array_member(node, "children", place), here, place);
  }

  void add_mesh(std::size_t number, const Json& node, const MeshInstance& here, const std::string& place) {
    const bool is_skinned = find_member(node, "skin", place) != nullptr;
    MeshInstance instance = is_skinned ? MeshInstance() : here;
    instance.mesh = size_member(node, "mesh", place);
    instance.node = number;
    instance.morph_weights = morph_weights(document_, node, instance.mesh, place);
    const std::vector<NodeCopy> copies =
        is_skinned ? std::vector<NodeCopy>() : copies_of(document_, node, limits_, place);
    if (copies.empty()) instances_.push_back(instance);
    for (const NodeCopy& copy : copies) {
      MeshInstance& placed = instances_.emplace_back(instance);
      placed.is_copy = true;
      placed.transform = instance.transform * copy.transform();
      placed.moved = instance.moved || !copy.transform().matrix().isIdentity(0);
    }
  }

  void push_children(const Json& children, const MeshInstance& parent, const std::string& place) {
    for (auto child = children.rbegin(); child != children.rend(); ++child) {
      pending_.push_back({size_value(*child, "children", place), parent});
    }
  }

  const Document& document_;
  const DecodeLimits& limits_;
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

std::vector<NodeCopy> copies_of(const Document& document, const Json& node, const DecodeLimits& limits,
                                const std::string& place) {
  const Json* extension = find_extension(node, kInstancing, place);
  if (extension == nullptr) return {};
  const Json* attributes = find_member(*extension, "attributes", place);
  if (attributes == nullptr || !attributes->is_object() || attributes->empty()) {
    throw Error(code::kMeshSyntax, fmt::format("'attributes' of {} is missing", kInstancing), place);
  }
  std::optional<std::size_t> count;
  for (const auto& [name, index] : attributes->items()) {
    const Accessor accessor = document.accessor(size_value(index, name.c_str(), place), place);
    if (count.value_or(accessor.count()) != accessor.count()) {
      throw Error(code::kMeshCountMismatch,
                  fmt::format("attributes of {} have {} and {} elements", kInstancing, *count, accessor.count()),
                  place);
    }
    count = accessor.count();
  }
  if (*count > limits.max_faces) {
    throw Error(code::kMeshTooLarge,
                fmt::format("{} copies of a mesh exceed the limit of {} faces", *count, limits.max_faces), place);
  }
  std::vector<NodeCopy> copies(*count);
  read_copies(document, *attributes, "TRANSLATION", &NodeCopy::translation, copies, place);
  read_copies(document, *attributes, "ROTATION", &NodeCopy::rotation, copies, place);
  read_copies(document, *attributes, "SCALE", &NodeCopy::scale, copies, place);
  return copies;
}

std::vector<MeshInstance> mesh_instances(const Document& document, const DecodeLimits& limits) {
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
  return NodeWalk(document, limits).from(array_member(scene, "nodes", place), place);
}

}  // namespace crease::gltf
