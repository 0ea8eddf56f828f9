#include <map>
#include <optional>

#include "core/io/corner_normals.h"
#include "core/io/gltf.h"
#include "core/io/gltf_layout.h"
#include "core/io/gltf_patch_file.h"
#include "core/io/text_patch.h"
#include "core/io/write_number.h"

namespace crease {
namespace {

using gltf::Accessor;
using gltf::Component;
using gltf::Json;

/// The accessors that a primitive has now.
struct PrimitiveAccessors {
  std::size_t primitive;  ///< of the mesh
  std::size_t old_position, position;
  std::optional<std::size_t> normal;
};

class GltfPatcher {
 public:
  GltfPatcher(std::string_view upload, const LabelledMesh& result)
      : document_(upload, kNoLimits),
        content_(read_gltf(document_, kNoLimits, layout_)),
        result_(result),
        file_(document_) {
    require_vertices(content_.mesh.positions.size(), result.mesh);
    if (layout_.triangles.size() == result.mesh.triangles.size()) return;
    throw Error(code::kMeshCountMismatch, fmt::format("the original file has {} faces, but the result has {}",
                                                      layout_.triangles.size(), result.mesh.triangles.size()));
  }

  std::string write(std::string_view upload) {
    find_normals();
    std::vector<std::vector<PrimitiveAccessors>> accessors(layout_.instances.size());
    for (const GltfLayout::Primitive& primitive : layout_.primitives) {
      accessors[primitive.instance].push_back(write_primitive(primitive));
    }
    for (std::size_t i = 0; i < accessors.size(); ++i) {
      file_.set_mesh(layout_.instances[i], mesh_with(layout_.instances[i].mesh, accessors[i]));
    }
    return file_.finish(upload);
  }

 private:
  static std::optional<std::size_t> normal_accessor(const GltfLayout::Primitive& primitive) {
    const Json& attributes = primitive.json->at("attributes");
    if (!attributes.contains("NORMAL")) return std::nullopt;
    return gltf::size_member(attributes, "NORMAL", "attributes");
  }

  /// Numbers the normals of each pair of positions and normals one after another, and gives them their corners.
  void find_normals() {
    std::size_t count = 0;
    for (const GltfLayout::Primitive& primitive : layout_.primitives) {
      const auto accessor = normal_accessor(primitive);
      if (!accessor) continue;
      const bool is_new = first_normal_.try_emplace({primitive.vertices.first, *accessor}, count).second;
      if (is_new) count += primitive.vertices.count;
    }
    if (count == 0) return;
    normals_.emplace(result_, count);
    for (const GltfLayout::Primitive& primitive : layout_.primitives) {
      const auto accessor = normal_accessor(primitive);
      if (!accessor) continue;
      const std::size_t first = first_normal_.at({primitive.vertices.first, *accessor});
      for (std::size_t face = primitive.first_face; face < primitive.first_face + primitive.face_count; ++face) {
        for (std::size_t place = 0; place < 3; ++place) {
          normals_->add(first + layout_.triangles[face][place] - primitive.vertices.first, face, place);
        }
      }
    }
  }

  PrimitiveAccessors write_primitive(const GltfLayout::Primitive& primitive) {
    const gltf::MeshInstance& instance = layout_.instances[primitive.instance];
    const std::string place = fmt::format("mesh {}", instance.mesh);
    const std::size_t position = gltf::size_member(primitive.json->at("attributes"), "POSITION", place);
    PrimitiveAccessors accessors{primitive.number, position, position, normal_accessor(primitive)};
    const auto [known, is_new] = positions_.try_emplace(primitive.vertices.first, position);
    if (is_new) known->second = file_.store(position, local_positions(primitive, instance, place), true);
    accessors.position = known->second;
    if (accessors.normal) {
      const std::size_t first = first_normal_.at({primitive.vertices.first, *accessors.normal});
      const auto [normal, is_new_normal] = stored_normals_.try_emplace(first, *accessors.normal);
      if (is_new_normal)
        normal->second = file_.store(*accessors.normal, local_normals(first, primitive, instance), false);
      accessors.normal = normal->second;
    }
    return accessors;
  }

  /// The positions of the result in the frame of the mesh, without what morph targets add.
  std::vector<Vec3> local_positions(const GltfLayout::Primitive& primitive, const gltf::MeshInstance& instance,
                                    const std::string& place) {
    const Eigen::Matrix3d linear = instance.transform.linear();
    if (!(std::abs(linear.determinant()) > 0) || !linear.inverse().allFinite()) {
      throw Error(code::kMeshUnsupported, "the node's transform is flat, so that positions have no place in the mesh",
                  place);
    }
    const Eigen::Affine3d inverse = instance.transform.inverse();
    std::vector<Vec3> moves(primitive.vertices.count, Vec3::Zero());
    for (const auto& [target, weight] : gltf::morphs_of(*primitive.json, instance, place)) {
      const std::vector<Vec3> offsets = file_.vectors(target);
      for (std::size_t i = 0; i < moves.size(); ++i) moves[i] += weight * offsets[i];
    }
    const std::size_t accessor = gltf::size_member(primitive.json->at("attributes"), "POSITION", place);
    std::vector<Vec3> positions = file_.vectors(accessor);
    for (std::size_t i = 0; i < positions.size(); ++i) {
      const Index vertex = layout_.vertex_of[primitive.vertices.first + i];
      const Vec3& here = result_.mesh.positions[vertex];
      if (here == content_.mesh.positions[vertex]) continue;
      positions[i] = (instance.moved ? Vec3(inverse * here) : here) - moves[i];
    }
    return positions;
  }

  std::vector<Vec3> local_normals(std::size_t first, const GltfLayout::Primitive& primitive,
                                  const gltf::MeshInstance& instance) {
    std::vector<Vec3> normals = file_.vectors(*normal_accessor(primitive));
    if (normals.size() != primitive.vertices.count) {
      throw Error(code::kMeshCountMismatch,
                  fmt::format("there are {} normals for {} vertices", normals.size(), primitive.vertices.count),
                  fmt::format("mesh {}", instance.mesh));
    }
    for (std::size_t i = 0; i < normals.size(); ++i) {
      if (const auto normal = (*normals_)[first + i]) {
        normals[i] = (instance.transform.linear().transpose() * *normal).stableNormalized();
      }
    }
    return normals;
  }

  /// The mesh over these accessors. Points and lines move with the triangles over the same positions.
  nlohmann::ordered_json mesh_with(std::size_t number, const std::vector<PrimitiveAccessors>& accessors) const {
    nlohmann::ordered_json mesh = file_.original_mesh(number);
    for (auto& primitive : mesh.at("primitives")) {
      const nlohmann::ordered_json::json_pointer path("/attributes/POSITION");
      if (!primitive.contains(path)) continue;
      const auto old = primitive[path].get<std::size_t>();
      const auto moved = std::ranges::find(accessors, old, &PrimitiveAccessors::old_position);
      if (moved != accessors.end()) primitive[path] = moved->position;
    }
    for (const PrimitiveAccessors& replaced : accessors) {
      auto& attributes = mesh.at("primitives").at(replaced.primitive).at("attributes");
      attributes["POSITION"] = replaced.position;
      if (replaced.normal) attributes["NORMAL"] = *replaced.normal;
    }
    return mesh;
  }

  gltf::Document document_;
  GltfLayout layout_;
  MeshContent content_;
  const LabelledMesh& result_;
  GltfPatchFile file_;
  /// The first number of a range of vertices and an accessor of normals.
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> first_normal_;
  std::optional<NormalMeans> normals_;
  std::map<std::size_t, std::size_t> positions_;       ///< accessors by the range of vertices
  std::map<std::size_t, std::size_t> stored_normals_;  ///< accessors by their first number
};

}  // namespace

std::string patch_gltf(std::string_view upload, const LabelledMesh& result) {
  return GltfPatcher(upload, result).write(upload);
}

}  // namespace crease
