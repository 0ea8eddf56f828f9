#include "core/io/ply.h"

#include <algorithm>
#include <array>

#include "core/base/text.h"
#include "core/io/mesh_builder.h"
#include "core/io/ply_body.h"
#include "core/io/ply_slots.h"

namespace crease {
namespace {

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

  void drop_others(const PlyElement& element, const PlySlots& slots, std::size_t list = kNone) {
    for (std::size_t k = 0; k < element.properties.size(); ++k) {
      if (k == list || slots[k] != kOther) continue;
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

  static PlySlots vertex_slots(const PlyElement& element) {
    constexpr std::array<std::string_view, 4> kNames{"x", "y", "z", "weight"};
    PlySlots slots(element);
    for (std::size_t k = 0; k < kNames.size(); ++k) {
      if (slots.count(k) == 1 || (k == kWeight && slots.count(k) == 0)) continue;
      throw Error(code::kMeshSyntax,
                  fmt::format("the vertices have {} properties '{}', expected one", slots.count(k), kNames[k]),
                  element.place);
    }
    slots.skip(kTexcoord);
    if (slots.count(kNormal) != 3) slots.skip(kNormal);
    return slots;
  }

  void read_vertices(const PlyElement& element) {
    PlySlots slots = vertex_slots(element);
    if (has_corner_texture()) slots.skip_texture();
    builder_.expect_vertices(element.count, least_bytes(element), body_.rest(), element.place);
    drop_others(element, slots);
    const bool weighted = slots.count(kWeight) != 0;
    const bool looks = slots.has_colour() || slots.has_texture();
    builder_.appearance().has_normals = slots.count(kNormal) == 3;
    std::array<double, kTexcoord> values{};
    values[kAlpha] = static_cast<double>(slots.full());
    for (std::size_t i = 0; i < element.count; ++i) {
      body_.begin_element();
      for (std::size_t k = 0; k < element.properties.size(); ++k) {
        if (slots[k] < kNormal) {
          values[slots[k]] = body_.number(element.properties[k].type);
        } else {
          skip_property(element.properties[k]);
        }
      }
      builder_.add_vertex(values[0], values[1], values[2], [&] { return body_.place(); });
      if (weighted) builder_.set_weight(i, values[kWeight], [&] { return body_.place(); });
      if (looks) add_look(slots, values);
      body_.end_element();
    }
    settle_colours(builder_.appearance().colours.values, "vertex colours");
  }

  static Colour colour_of(const PlySlots& slots, const std::array<double, kTexcoord>& values) {
    Colour colour{};
    for (std::size_t k = 0; k < 4; ++k) colour[k] = static_cast<float>(values[kRed + k]) / slots.full();
    return colour;
  }

  void add_look(const PlySlots& slots, const std::array<double, kTexcoord>& values) {
    Appearance& look = builder_.appearance();
    if (slots.has_colour()) look.colours.values.push_back(colour_of(slots, values));
    if (!slots.has_texture()) return;
    if (look.texture.empty()) look.texture.emplace_back();
    look.texture.front().values.push_back({static_cast<float>(values[kU]), static_cast<float>(values[kV])});
  }

  /// Colours in floats that are not from 0 to 1 are none.
  void settle_colours(std::vector<Colour>& colours, std::string_view what) {
    const auto fits = [](float value) { return value >= 0 && value <= 1; };
    if (std::ranges::all_of(colours, [&](const Colour& colour) { return std::ranges::all_of(colour, fits); })) return;
    colours.clear();
    builder_.drop(fmt::format("{} that are not from 0 to 1", what));
  }

  bool has_corner_texture() const {
    return std::ranges::any_of(header_.elements, [](const PlyElement& element) {
      return element.name == "face" && element.count > 0 &&
             std::ranges::any_of(element.properties, [](const auto& one) { return slot_of(one) == kTexcoord; });
    });
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
    const PlySlots slots = face_slots(element);
    drop_others(element, slots, list);
    const bool has_colour = slots.has_colour(), has_texture = slots.count(kTexcoord) != 0;
    std::array<double, kTexcoord> values{};
    values[kAlpha] = static_cast<double>(slots.full());
    for (std::size_t i = 0; i < element.count; ++i) {
      body_.begin_element();
      for (std::size_t k = 0; k < element.properties.size(); ++k) {
        const PlyProperty& property = element.properties[k];
        if (k == list) {
          read_corners(property);
        } else if (slots[k] == kTexcoord) {
          read_corner_texture(property);
        } else if (slots[k] < kTexcoord) {
          values[slots[k]] = body_.number(property.type);
        } else {
          skip_property(property);
        }
      }
      builder_.add_face(corners_, [&] { return body_.place(); });
      if (has_colour) builder_.add_face_colour(colour_of(slots, values));
      if (has_texture) add_corner_texture();
      body_.end_element();
    }
    settle_colours(builder_.appearance().face_colours, "face colours");
  }

  /// Of the properties that vertices have, only colours have a meaning for faces.
  static PlySlots face_slots(const PlyElement& element) {
    PlySlots slots(element);
    for (const std::size_t slot : {std::size_t{0}, std::size_t{1}, std::size_t{2}, std::size_t{kWeight}}) {
      slots.skip(slot);
    }
    slots.skip(kNormal);
    slots.skip_texture();
    if (slots.count(kTexcoord) > 1) slots.skip(kTexcoord);
    return slots;
  }

  void read_corner_texture(const PlyProperty& property) {
    const std::size_t count = body_.length(*property.count_type);
    body_.require(property.type, count);
    corner_texture_.clear();
    for (std::size_t k = 0; k < count; ++k) {
      corner_texture_.push_back(static_cast<float>(body_.number(property.type)));
    }
  }

  void add_corner_texture() {
    if (corner_texture_.empty()) return;
    if (corner_texture_.size() != 2 * corners_.size()) {
      builder_.drop("lists texcoord whose length does not fit the face");
      return;
    }
    Appearance& look = builder_.appearance();
    if (look.texture.empty()) look.texture.emplace_back();
    std::vector<std::array<float, 2>>& values = look.texture.front().values;
    std::vector<Index> numbers;
    for (std::size_t k = 0; k < corners_.size(); ++k) {
      numbers.push_back(static_cast<Index>(values.size()));
      values.push_back({corner_texture_[2 * k], corner_texture_[2 * k + 1]});
    }
    builder_.add_texture(numbers);
  }

  static bool has_corner_list(const PlyElement& element) {
    return std::ranges::any_of(element.properties, is_corner_list);
  }

  /// Strips have no property beside their corners.
  static PlySlots strip_slots(const PlyElement& element) {
    PlySlots slots = face_slots(element);
    for (std::size_t slot = kRed; slot <= kTexcoord; ++slot) slots.skip(slot);
    return slots;
  }

  /// Strips of triangles one after another, with −1 between them. Triangles without area that only connect parts of a
  /// strip are no faces.
  void read_strips(const PlyElement& element) {
    const std::size_t list = corner_list(element);
    drop_others(element, strip_slots(element), list);
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
  std::vector<float> corner_texture_;  ///< of the current face
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

}  // namespace crease
