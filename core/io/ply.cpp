#include "core/io/ply.h"

#include <algorithm>
#include <array>
#include <numbers>

#include "core/base/text.h"
#include "core/io/mesh_builder.h"
#include "core/io/ply_body.h"
#include "core/io/write_number.h"

namespace crease {
namespace {

/// The content of a vertex property: a coordinate (0 to 2), the weight, or something that is skipped.
enum Slot : std::size_t { kWeight = 3, kOther = 4 };

template <typename Body>
class BodyReader {
 public:
  BodyReader(Body body, const PlyHeader& header, const DecodeLimits& limits)
      : body_(std::move(body)), header_(header), builder_(limits) {}

  MeshContent read() {
    for (const PlyElement& element : header_.elements) {
      if (element.name != "vertex") continue;
      vertex_count_ = element.count;
      if (vertex_count_ > builder_.limits().max_vertices) {
        MeshBuilder::fail_too_large("vertices", builder_.limits().max_vertices, element.place);
      }
    }
    for (const PlyElement& element : header_.elements) {
      if (element.name == "vertex") {
        read_vertices(element);
      } else if (element.name == "face") {
        read_faces(element);
      } else if (element.name == "tristrips" && has_corner_list(element)) {
        read_strips(element);
      } else {
        if (element.count != 0 && !is_ours(element)) builder_.drop("element " + printable(element.name));
        skip_elements(element);
      }
    }
    warn_of_odd_weights();
    if (body_.has_trailing()) {
      builder_.warn("trailing_bytes", "ignored everything after the last element, from " + body_.place());
    }
    return builder_.finish();
  }

 private:
  static std::size_t least_bytes(const PlyElement& element) {
    std::size_t bytes = 0;
    for (const PlyProperty& property : element.properties) {
      bytes += Body::least_bytes(property.count_type.value_or(property.type));
    }
    return bytes;
  }

  void skip_property(const PlyProperty& property) {
    body_.skip(property.type, property.count_type ? body_.length(*property.count_type) : 1);
  }

  /// Edges with labels are those of an earlier result, whose place the next one takes.
  static bool is_ours(const PlyElement& element) {
    return element.name == "edge" && std::ranges::any_of(element.properties, [](const PlyProperty& property) {
             return property.name == "label";
           });
  }

  void drop_others(const PlyElement& element, std::size_t list) {
    for (std::size_t k = 0; k < element.properties.size(); ++k) {
      if (k == list) continue;
      builder_.drop(printable(element.name) + " property " + printable(element.properties[k].name));
    }
  }

  void skip_elements(const PlyElement& element) {
    const std::size_t least = least_bytes(element);
    if (least == 0) return;
    if (element.count > body_.rest() / least) {
      throw Error(code::kMeshTruncated,
                  fmt::format("the remaining {} bytes cannot hold {} elements '{}'", body_.rest(), element.count,
                              printable(element.name)),
                  element.place);
    }
    for (std::size_t i = 0; i < element.count; ++i) {
      body_.begin_element();
      for (const PlyProperty& property : element.properties) skip_property(property);
      body_.end_element();
    }
  }

  static std::vector<std::size_t> vertex_slots(const PlyElement& element) {
    constexpr std::array<std::string_view, 4> kNames{"x", "y", "z", "weight"};
    std::vector<std::size_t> slots;
    std::array<int, kOther + 1> seen{};
    for (const PlyProperty& property : element.properties) {
      const auto name = property.count_type ? kNames.end() : std::find(kNames.begin(), kNames.end(), property.name);
      slots.push_back(static_cast<std::size_t>(name - kNames.begin()));
      ++seen[slots.back()];
    }
    for (std::size_t k = 0; k < kNames.size(); ++k) {
      if (seen[k] == 1 || (k == kWeight && seen[k] == 0)) continue;
      throw Error(code::kMeshSyntax,
                  fmt::format("the vertices have {} properties '{}', expected one", seen[k], kNames[k]), element.place);
    }
    return slots;
  }

  void read_vertices(const PlyElement& element) {
    const std::vector<std::size_t> slots = vertex_slots(element);
    builder_.expect_vertices(element.count, least_bytes(element), body_.rest(), element.place);
    for (std::size_t k = 0; k < slots.size(); ++k) {
      if (slots[k] == kOther) builder_.drop("vertex property " + printable(element.properties[k].name));
    }
    const bool weighted = std::find(slots.begin(), slots.end(), kWeight) != slots.end();
    std::array<double, kOther> values{};
    for (std::size_t i = 0; i < element.count; ++i) {
      body_.begin_element();
      for (std::size_t k = 0; k < slots.size(); ++k) {
        if (slots[k] < kOther) {
          values[slots[k]] = body_.number(element.properties[k].type);
        } else {
          skip_property(element.properties[k]);
        }
      }
      builder_.add_vertex(values[0], values[1], values[2], [&] { return body_.place(); });
      if (weighted) builder_.set_weight(i, values[kWeight], [&] { return body_.place(); });
      body_.end_element();
    }
  }

  static std::size_t corner_list(const PlyElement& element) {
    const auto& properties = element.properties;
    const auto found = std::find_if(properties.begin(), properties.end(), is_corner_list);
    if (found == properties.end()) {
      throw Error(code::kMeshNoFaces, "the faces have neither a list 'vertex_indices' nor 'vertex_index'",
                  element.place);
    }
    if (found->type == PlyType::kFloat32 || found->type == PlyType::kFloat64) {
      throw Error(code::kMeshSyntax, "vertex indices must have an integer type", element.place);
    }
    return static_cast<std::size_t>(found - properties.begin());
  }

  void read_faces(const PlyElement& element) {
    if (element.count == 0) return;
    const std::size_t list = corner_list(element);
    builder_.expect_faces(element.count, least_bytes(element), body_.rest(), element.place);
    drop_others(element, list);
    for (std::size_t i = 0; i < element.count; ++i) {
      body_.begin_element();
      for (std::size_t k = 0; k < element.properties.size(); ++k) {
        if (k == list) {
          read_corners(element.properties[k]);
        } else {
          skip_property(element.properties[k]);
        }
      }
      builder_.add_face(corners_, [&] { return body_.place(); });
      body_.end_element();
    }
  }

  static bool has_corner_list(const PlyElement& element) {
    return std::ranges::any_of(element.properties, is_corner_list);
  }

  /// Strips of triangles one after another, with −1 between them. Triangles without area that only connect parts of a
  /// strip are no faces.
  void read_strips(const PlyElement& element) {
    const std::size_t list = corner_list(element);
    drop_others(element, list);
    for (std::size_t i = 0; i < element.count; ++i) {
      body_.begin_element();
      for (std::size_t k = 0; k < element.properties.size(); ++k) {
        if (k == list) {
          read_strip(element.properties[k]);
        } else {
          skip_property(element.properties[k]);
        }
      }
      body_.end_element();
    }
  }

  void read_strip(const PlyProperty& property) {
    const std::size_t count = body_.length(*property.count_type);
    body_.require(property.type, count);
    corners_.clear();
    for (std::size_t k = 0; k < count; ++k) {
      const std::int64_t index = body_.integer(property.type);
      if (index == -1 || (property.type == PlyType::kUint32 && index == kNone)) {
        corners_.clear();
        continue;
      }
      corners_.push_back(builder_.checked_index(index, vertex_count_));
      const std::size_t size = corners_.size();
      if (size < 3) continue;
      Triangle triangle{corners_[size - 3], corners_[size - 2], corners_[size - 1]};
      if (size % 2 == 0) std::swap(triangle[0], triangle[1]);
      const bool connects = triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0];
      if (!connects) builder_.add_face(triangle, [&] { return body_.place(); });
    }
  }

  /// Other programs give a property of this name other meanings.
  void warn_of_odd_weights() {
    constexpr double kMostOfOurs = 16;
    const std::vector<double>& weights = builder_.weights();
    if (weights.empty()) return;
    const auto [least, most] = std::ranges::minmax(weights);
    if (most > 0 && most <= kMostOfOurs) return;
    builder_.warn("weights_unusual",
                  fmt::format("the vertex property 'weight' has values from {} to {}: they are taken "
                              "as weights of the likelihood, where 1 is usual",
                              least, most));
  }

  void read_corners(const PlyProperty& property) {
    const std::size_t count = body_.length(*property.count_type);
    body_.require(property.type, count);
    corners_.clear();
    for (std::size_t k = 0; k < count; ++k) {
      corners_.push_back(builder_.checked_index(body_.integer(property.type), vertex_count_));
    }
  }

  Body body_;
  const PlyHeader& header_;
  MeshBuilder builder_;
  std::size_t vertex_count_ = 0;
  std::vector<Index> corners_;
};

}  // namespace

Likeness looks_like_ply(const Sample& sample) {
  return sample.word == "ply" && sample.text.starts_with("ply") ? Likeness::kMagic : Likeness::kUnlike;
}

MeshContent read_ply(std::string_view bytes, const DecodeLimits& limits) {
  TextCursor cursor(bytes, {});
  const PlyHeader header = read_ply_header(bytes, cursor);
  if (header.encoding == PlyEncoding::kAscii) return BodyReader(PlyAsciiBody(cursor), header, limits).read();
  const bool big_endian = header.encoding == PlyEncoding::kBigEndian;
  return BodyReader(PlyBinaryBody(bytes, header.binary_start, big_endian), header, limits).read();
}

std::string write_ply(const LabelledMesh& result, const nlohmann::ordered_json& /*extras*/) {
  const Mesh& mesh = result.mesh;
  const bool has_sigma = !result.sigma.empty();
  const std::string edges = fmt::format(
      "element edge {}\nproperty uint vertex1\nproperty uint vertex2\nproperty float label\nproperty float "
      "dihedral_deg\n",
      result.edges.size());
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\n"
      "element vertex {}\nproperty double x\nproperty double y\nproperty double z\n{}"
      "element face {}\nproperty list uchar uint vertex_indices\n{}end_header\n",
      mesh.positions.size(), has_sigma ? "property double sigma\n" : "", mesh.triangles.size(),
      result.edges.empty() ? "" : edges);
  bytes.reserve(bytes.size() + (has_sigma ? 32 : 24) * mesh.positions.size() + 13 * mesh.triangles.size() +
                16 * result.edges.size());
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    for (const double coordinate : mesh.positions[v]) append_little_endian(bytes, coordinate);
    if (has_sigma) append_little_endian(bytes, result.sigma[v]);
  }
  for (const Triangle& triangle : mesh.triangles) {
    append_little_endian(bytes, static_cast<std::uint8_t>(3));
    for (const Index corner : triangle) append_little_endian(bytes, corner);
  }
  for (std::size_t e = 0; e < result.edges.size(); ++e) {
    append_little_endian(bytes, result.edges[e].v0);
    append_little_endian(bytes, result.edges[e].v1);
    append_little_endian(bytes, static_cast<float>(result.labels[e]));
    append_little_endian(bytes, static_cast<float>(result.dihedral_rad[e] * 180 / std::numbers::pi));
  }
  return bytes;
}

}  // namespace crease
