#pragma once

#include <Eigen/Core>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/io/byte_cursor.h"
#include "core/io/format.h"
#include "core/io/gltf_terms.h"
#include "core/io/read_gltf_json.h"

namespace crease::gltf {

std::size_t size_of(Component component);

/// An extension of an object, or null. \throw Error mesh_syntax with `place`
const Json* find_extension(const Json& object, const char* name, const std::string& place);

/// `count` elements in a buffer that is known to be long enough.
struct Elements {
  const char* data = nullptr;  ///< null if all elements are zero
  std::size_t stride = 0;
  std::size_t count = 0;
  Component component = Component::kFloat;
};

/// An accessor that has been checked: every element can be read.
struct Accessor {
  Elements elements;
  std::size_t components = 1;  ///< 1 for SCALAR to 4 for VEC4
  bool normalized = false;     ///< integers represent the range 0 to 1, or −1 to 1
  Elements sparse_indices;     ///< the elements that are replaced; count 0 if there are none
  Elements sparse_values;
  std::string place;

  std::size_t count() const { return elements.count; }
};

/// A glTF or GLB file with its buffers, which must be embedded.
class Document {
 public:
  /// Primitives that Draco has compressed are decoded within the limits.
  /// \throw Error mesh_syntax, mesh_truncated, mesh_unsupported, mesh_too_large, mesh_count_mismatch
  explicit Document(std::string_view bytes, const DecodeLimits& limits);

  const Json& root() const { return root_; }
  /// The number of bytes after the end of a GLB.
  std::size_t trailing_bytes() const { return trailing_bytes_; }
  bool is_binary() const { return is_binary_; }
  /// The JSON as it stands in the file.
  std::string_view json_text() const { return json_text_; }
  const std::vector<std::string_view>& buffers() const { return buffers_; }
  /// Whether the buffer is the binary chunk of a GLB.
  bool is_binary_chunk(std::size_t buffer) const {
    return binary_chunk_ && buffers_.at(buffer).data() == binary_chunk_->data();
  }

  /// An entry of an array of the root. \throw Error mesh_index_out_of_range with `place`, the entry that refers to it
  const Json& entry(const char* array, std::size_t index, const std::string& place) const;

  /// \throw Error mesh_syntax, mesh_index_out_of_range, mesh_count_mismatch, mesh_unsupported
  Accessor accessor(std::size_t index, const std::string& place) const;

  /// What Draco has compressed, by the accessors that have no other data.
  const std::map<std::size_t, std::string>& from_draco() const { return from_draco_; }

  /// The bytes of a buffer view. \throw Error as accessor
  std::string_view view(std::size_t index, const std::string& place) const;

 private:
  void read_chunks(std::string_view bytes);
  void check_versions() const;
  void load_buffers();
  void load_draco(const DecodeLimits& limits);
  void load_primitive(const Json& primitive, const DecodeLimits& limits, const std::string& place);
  void store_indices(std::size_t accessor, const std::vector<std::uint32_t>& indices, const std::string& place);
  bool has_data(std::size_t accessor, const std::string& place) const;
  std::string_view buffer_data(std::size_t index, Json& buffer, const std::string& place);
  std::string_view bytes_in_buffer(const Json& view, const std::string& place) const;
  /// The bytes of a view, decompressed where they are compressed.
  std::string_view view_data(std::size_t index, const Json& view, const std::string& place) const;
  Elements elements(const Json& object, std::size_t count, Component component, std::size_t components,
                    const std::string& place) const;
  void read_sparse(const Json& sparse, Accessor& accessor) const;

  std::size_t file_size_;
  std::size_t trailing_bytes_ = 0;
  bool is_binary_ = false;
  std::string_view json_text_;
  Json root_;
  std::optional<std::string_view> binary_chunk_;
  std::deque<std::string> decoded_;
  std::vector<std::string_view> buffers_;
  std::map<std::size_t, std::string> from_draco_;            ///< by their accessors
  mutable std::map<std::size_t, std::string> decompressed_;  ///< by their views, when they are first used
};

/// Loads an unsigned integer of one component. \throw Error mesh_syntax for other component types
std::uint32_t load_unsigned(const char* at, Component component, const std::string& place);

/// Loads one component of the accessor as the number that it represents.
double load_number(const char* at, const Accessor& accessor);

/// Loads an element of three components.
Eigen::Vector3d load_vector(const char* at, const Accessor& accessor);

/// Calls `visit(element, bytes)` for every element in order, then for the elements that a sparse accessor replaces.
template <typename Visit>
void for_each_element(const Accessor& accessor, Visit&& visit) {
  constexpr std::array<char, 16> kZeros{};
  for (std::size_t i = 0; i < accessor.count(); ++i) {
    visit(i, accessor.elements.data == nullptr ? kZeros.data() : accessor.elements.data + i * accessor.elements.stride);
  }
  const Elements& indices = accessor.sparse_indices;
  for (std::size_t i = 0; i < indices.count; ++i) {
    const std::size_t element = load_unsigned(indices.data + i * indices.stride, indices.component, accessor.place);
    if (element >= accessor.count()) {
      throw Error(code::kMeshIndexOutOfRange,
                  fmt::format("a sparse index is {}, but there are {} elements", element, accessor.count()),
                  accessor.place);
    }
    visit(element, accessor.sparse_values.data + i * accessor.sparse_values.stride);
  }
}

}  // namespace crease::gltf
