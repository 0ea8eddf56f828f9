#include <array>
#include <cmath>
#include <map>
#include <span>
#include <tuple>
#include <utility>

#include "core/base/text.h"
#include "core/io/gltf.h"
#include "core/io/gltf_layout.h"
#include "core/io/gltf_looks.h"
#include "core/io/mesh_builder.h"
#include "core/mesh/position_index.h"

namespace crease {
namespace {

using gltf::Accessor;
using gltf::Component;
using gltf::Json;

enum Mode : std::uint8_t { kTriangles = 4, kStrip = 5, kFan = 6 };

class GltfReader {
 public:
  /// With a layout, tells there what came from where. `document` must outlive this.
  GltfReader(const gltf::Document& document, const DecodeLimits& limits, GltfLayout* layout)
      : document_(document), builder_(limits), layout_(layout) {}

  MeshContent read() {
    std::vector<gltf::MeshInstance> instances = mesh_instances(document_, builder_.limits());
    for (instance_ = 0; instance_ < instances.size(); ++instance_) read_instance(instances[instance_]);
    if (layout_ != nullptr) layout_->triangles = builder_.mesh().triangles;
    looks_.finish();
    share_vertices();
    materials_.finish();
    note_dropped();
    if (layout_ != nullptr) {
      layout_->instances = std::move(instances);
      layout_->vertex_of = std::move(vertex_of_);
    }
    if (skipped_ != 0) {
      builder_.warn("primitives_skipped",
                    "skipped " + counted(skipped_, "primitive", "primitives") + " of points or lines");
    }
    if (document_.trailing_bytes() != 0) {
      builder_.warn("trailing_bytes",
                    "ignored " + counted(document_.trailing_bytes(), "byte", "bytes") + " after the end of the GLB");
    }
    return builder_.finish();
  }

 private:
  void read_instance(const gltf::MeshInstance& instance) {
    const std::string place = fmt::format("mesh {}", instance.mesh);
    const Json& mesh = document_.entry("meshes", instance.mesh, place);
    ranges_.clear();
    const Json& primitives = gltf::array_member(mesh, "primitives", place);
    for (primitive_ = 0; primitive_ < primitives.size(); ++primitive_) {
      read_primitive(primitives[primitive_], instance, place);
    }
  }

  void read_primitive(const Json& primitive, const gltf::MeshInstance& instance, const std::string& place) {
    const std::size_t mode = gltf::size_member_or(primitive, "mode", kTriangles, place);
    if (mode > kFan) throw Error(code::kMeshSyntax, fmt::format("primitive mode {} does not exist", mode), place);
    if (mode < kTriangles) {
      ++skipped_;
      return;
    }
    const Json* attributes = gltf::find_member(primitive, "attributes", place);
    if (attributes == nullptr) throw Error(code::kMeshSyntax, "'attributes' is missing", place);
    note_attributes(primitive, place);
    materials_.start(primitive, place);
    const VertexRange range = read_vertices(*attributes, gltf::morphs_of(primitive, instance, place), instance, place);
    const std::vector<Index> corners = read_corners(primitive, range, place);
    if (mode == kTriangles ? corners.size() % 3 != 0 : corners.size() < 3) {
      throw Error(code::kMeshCountMismatch, fmt::format("{} corners do not make up triangles", corners.size()), place);
    }
    const std::size_t first_face = builder_.faces();
    add_triangles(corners, static_cast<Mode>(mode), range, instance.transform.linear().determinant() < 0);
    if (layout_ != nullptr) {
      layout_->primitives.push_back(
          {instance_, primitive_, &primitive, range, first_face, builder_.faces() - first_face});
    }
  }

  VertexRange read_vertices(const Json& attributes, const gltf::Morphs& morphs, const gltf::MeshInstance& instance,
                            const std::string& place) {
    const std::size_t index = gltf::size_member(attributes, "POSITION", place);
    const auto [known, is_new] = ranges_.try_emplace({index, morphs, looks_.accessors(attributes, place)});
    VertexRange& range = known->second;
    if (is_new) read_new_vertices(index, attributes, morphs, instance, range, place);
    if (!range.weighted && attributes.contains("_WEIGHT")) {
      read_weights(gltf::size_member(attributes, "_WEIGHT", place), range, place);
    }
    return range;
  }

  /// Integers are those of KHR_mesh_quantization.
  Accessor vectors(std::size_t index, const std::string& place) const {
    Accessor accessor = document_.accessor(index, place);
    if (accessor.components != 3 || accessor.elements.component == Component::kUint32) {
      throw Error(code::kMeshUnsupported, "positions must be VEC3 of float, or of 8-bit or 16-bit integers",
                  accessor.place);
    }
    return accessor;
  }

  void read_new_vertices(std::size_t index, const Json& attributes, const gltf::Morphs& morphs,
                         const gltf::MeshInstance& instance, VertexRange& range, const std::string& place) {
    const Accessor accessor = vectors(index, place);
    range = {builder_.vertices(), accessor.count()};
    if (range.count > builder_.limits().max_vertices - range.first) {
      MeshBuilder::fail_too_large("vertices", builder_.limits().max_vertices, accessor.place);
    }
    read_positions(accessor, morphs, instance, range);
    looks_.read(attributes, range, place);
    if (attributes.contains("_SOURCE")) read_sources(gltf::size_member(attributes, "_SOURCE", place), range, place);
  }

  void read_positions(const Accessor& accessor, const gltf::Morphs& morphs, const gltf::MeshInstance& instance,
                      const VertexRange& range) {
    std::vector<Vec3>& positions = builder_.mesh().positions;
    positions.resize(range.first + range.count);
    const std::span<Vec3> read(positions.data() + range.first, range.count);
    gltf::for_each_element(
        accessor, [&](std::size_t element, const char* bytes) { read[element] = gltf::load_vector(bytes, accessor); });
    for (const auto& [target, weight] : morphs) add_morph(target, weight, read, accessor.place);
    if (instance.moved) {
      for (Vec3& position : read) position = instance.transform * position;
    }
    for (std::size_t i = 0; i < range.count; ++i) {
      if (read[i].allFinite()) continue;
      throw Error(code::kMeshNotFinite, "a vertex has a coordinate that is not a finite number",
                  fmt::format("{}, element {}", accessor.place, i));
    }
  }

  void add_morph(std::size_t target, double weight, std::span<Vec3> positions, const std::string& place) const {
    const Accessor moves = vectors(target, place);
    if (moves.count() != positions.size()) {
      throw Error(code::kMeshCountMismatch,
                  fmt::format("a morph target has {} positions for {} vertices", moves.count(), positions.size()),
                  moves.place);
    }
    // A sparse accessor replaces elements, so its values are added at the end.
    std::vector<Vec3> offsets(positions.size());
    gltf::for_each_element(
        moves, [&](std::size_t element, const char* bytes) { offsets[element] = gltf::load_vector(bytes, moves); });
    for (std::size_t i = 0; i < positions.size(); ++i) positions[i] += weight * offsets[i];
  }

  void read_weights(std::size_t index, VertexRange& range, const std::string& place) {
    const Accessor accessor = document_.accessor(index, place);
    if (accessor.components != 1) throw Error(code::kMeshSyntax, "weights must be SCALAR", accessor.place);
    if (accessor.count() != range.count) {
      throw Error(code::kMeshCountMismatch,
                  fmt::format("there are {} weights for {} vertices", accessor.count(), range.count), accessor.place);
    }
    std::vector<double> weights(range.count);
    gltf::for_each_element(accessor, [&](std::size_t element, const char* bytes) {
      weights[element] = gltf::load_number(bytes, accessor);
    });
    for (std::size_t i = 0; i < range.count; ++i) {
      builder_.set_weight(range.first + i, weights[i],
                          [&] { return fmt::format("{}, element {}", accessor.place, i); });
    }
    range.weighted = true;
  }

  /// Reads the originals of copied vertices. If the attribute has any other meaning, it is ignored with a warning.
  void read_sources(std::size_t index, const VertexRange& range, const std::string& place) {
    const Accessor accessor = document_.accessor(index, place);
    std::vector<double> sources(accessor.count());
    gltf::for_each_element(accessor, [&](std::size_t element, const char* bytes) {
      const Component component = accessor.elements.component;
      sources[element] = component == Component::kFloat ? static_cast<double>(load<float>(bytes, false))
                                                        : gltf::load_unsigned(bytes, component, accessor.place);
    });
    if (accessor.components != 1 || !name_originals(sources, range)) {
      builder_.warn("source_ignored", "ignored the attribute _SOURCE of " + place +
                                          ": it does not name the originals of copied vertices");
      return;
    }
    for (std::size_t v = originals_.size(); v < range.first; ++v) originals_.push_back(static_cast<Index>(v));
    for (const double source : sources) {
      originals_.push_back(static_cast<Index>(range.first + static_cast<std::size_t>(source)));
    }
  }

  bool name_originals(const std::vector<double>& sources, const VertexRange& range) {
    if (sources.size() != range.count) return false;
    const std::vector<Vec3>& positions = builder_.mesh().positions;
    for (std::size_t i = 0; i < sources.size(); ++i) {
      if (!(sources[i] >= 0 && sources[i] <= static_cast<double>(i)) || std::floor(sources[i]) != sources[i]) {
        return false;
      }
      const auto original = static_cast<std::size_t>(sources[i]);
      if (sources[original] != sources[i] || positions[range.first + original] != positions[range.first + i]) {
        return false;
      }
    }
    return true;
  }

  std::vector<Index> read_corners(const Json& primitive, const VertexRange& range, const std::string& place) {
    std::vector<Index> corners;
    if (gltf::find_member(primitive, "indices", place) == nullptr) {
      for (std::size_t i = 0; i < range.count; ++i) corners.push_back(static_cast<Index>(i));
      return corners;
    }
    const Accessor accessor = document_.accessor(gltf::size_member(primitive, "indices", place), place);
    if (accessor.components != 1) throw Error(code::kMeshSyntax, "indices must be SCALAR", accessor.place);
    if (accessor.count() / 3 > builder_.limits().max_faces) {
      MeshBuilder::fail_too_large("faces", builder_.limits().max_faces, accessor.place);
    }
    corners.resize(accessor.count());
    gltf::for_each_element(accessor, [&](std::size_t element, const char* bytes) {
      corners[element] = gltf::load_unsigned(bytes, accessor.elements.component, accessor.place);
    });
    return corners;
  }

  void add_triangles(const std::vector<Index>& corners, Mode mode, const VertexRange& range, bool mirrored) {
    const std::size_t count = mode == kTriangles ? corners.size() / 3 : corners.size() - 2;
    for (std::size_t i = 0; i < count; ++i) {
      std::array<std::size_t, 3> at{3 * i, 3 * i + 1, 3 * i + 2};
      if (mode == kStrip) at = {i, i + 1 + i % 2, i + 2 - i % 2};
      if (mode == kFan) at = {i + 1, i + 2, 0};
      if (mirrored) std::swap(at[1], at[2]);
      Triangle triangle{};
      for (std::size_t k = 0; k < 3; ++k) {
        triangle[k] = static_cast<Index>(range.first) + builder_.checked_index(corners[at[k]], range.count);
      }
      builder_.add_face(triangle, [&] { return builder_.face_place(); });
    }
  }

  /// Notes what only the original keeps.
  void note_dropped() {
    const Json& root = document_.root();
    for (const char* array : {"animations", "skins", "cameras"}) {
      if (!gltf::array_member(root, array, array).empty()) builder_.drop(array);
    }
    if (gltf::array_member(root, "nodes", "nodes").size() > 1) builder_.drop("nodes");
  }

  void note_attributes(const Json& primitive, const std::string& place) {
    constexpr std::array<std::string_view, 7> kOfResults{"POSITION", "_WEIGHT", "_SOURCE", "_LABEL",
                                                         "_CLASS",   "_SIGMA",  "_SEGMENT"};
    const Json* attributes = gltf::find_member(primitive, "attributes", place);
    if (attributes == nullptr || !attributes->is_object()) return;
    for (const auto& [name, accessor] : attributes->items()) {
      if (name == "NORMAL") {
        builder_.appearance().has_normals = true;
      } else if (std::ranges::find(kOfResults, name) == kOfResults.end() && !looks_.is_read(name, *attributes)) {
        builder_.drop("attribute " + printable(name));
      }
    }
    if (!gltf::array_member(primitive, "targets", place).empty()) builder_.drop("morph targets");
  }

  /// Joins vertices. Files for rendering have a copy of a vertex for each of its normals or texture coordinates;
  /// without joining them, the surface would fall apart.
  void share_vertices() {
    if (!originals_.empty()) {
      fold_copies();
      return;
    }
    vertex_of_ = weld_by_position(builder_.mesh(), builder_.weights());
    const std::size_t removed = vertex_of_.size() - builder_.vertices();
    if (removed == 0) return;
    builder_.warn("vertices_welded",
                  "welded " + counted(removed, "vertex", "vertices") + " to earlier ones at exactly the same position");
  }

  void fold_copies() {
    Mesh& mesh = builder_.mesh();
    std::vector<double>& weights = builder_.weights();
    for (std::size_t v = originals_.size(); v < mesh.positions.size(); ++v) originals_.push_back(static_cast<Index>(v));
    vertex_of_.resize(originals_.size());
    Index kept = 0;
    for (std::size_t v = 0; v < originals_.size(); ++v) {
      if (originals_[v] == v) {
        mesh.positions[kept] = mesh.positions[v];
        if (!weights.empty()) weights[kept] = weights[v];
        vertex_of_[v] = kept++;
      } else {
        vertex_of_[v] = vertex_of_[originals_[v]];  // an original comes before its copies
      }
    }
    mesh.positions.resize(kept);
    if (!weights.empty()) weights.resize(kept);
    for (Triangle& triangle : mesh.triangles) {
      for (Index& corner : triangle) corner = vertex_of_[corner];
    }
  }

  const gltf::Document& document_;
  MeshBuilder builder_;
  GltfLayout* layout_;
  std::size_t instance_ = 0, primitive_ = 0;  ///< being read
  GltfLooks looks_{document_, builder_};
  GltfMaterials materials_{document_, builder_};
  /// Of the current instance, by POSITION accessor, morph targets, and accessors of colours and texture coordinates.
  std::map<std::tuple<std::size_t, gltf::Morphs, std::vector<std::size_t>>, VertexRange> ranges_;
  std::vector<Index> originals_;  ///< per vertex, if a _SOURCE names them; may be shorter than the list of vertices
  std::vector<Index> vertex_of_;  ///< per vertex before they are shared
  std::size_t skipped_ = 0;
};

}  // namespace

Likeness looks_like_glb(const Sample& sample) {
  return sample.bytes.starts_with("glTF") ? Likeness::kCertain : Likeness::kUnlike;
}

Likeness looks_like_gltf(const Sample& sample) {
  const bool is_gltf = sample.word.starts_with('{') && sample.text.find("\"asset\"") != std::string_view::npos;
  return is_gltf ? Likeness::kText : Likeness::kUnlike;
}

MeshContent read_gltf(std::string_view bytes, const DecodeLimits& limits) {
  const gltf::Document document(bytes, limits);
  return GltfReader(document, limits, nullptr).read();
}

MeshContent read_gltf(const gltf::Document& document, const DecodeLimits& limits, GltfLayout& layout) {
  return GltfReader(document, limits, &layout).read();
}

}  // namespace crease
