#include "core/io/gltf_compressed.h"

#include <fmt/format.h>
#include <meshoptimizer.h>

#include "core/base/text.h"
#include "core/error.h"

namespace crease::gltf {
namespace {

/// The bytes that one compressed byte stands for at most: vertices have 2 bits for 16 equal bytes.
constexpr std::size_t kMostBytesPerByte = 64;

std::string text_member(const Json& object, const char* name, const std::string& otherwise, const std::string& place) {
  const Json* value = find_member(object, name, place);
  if (value == nullptr) return otherwise;
  if (!value->is_string()) throw Error(code::kMeshSyntax, fmt::format("'{}' must be a string", name), place);
  return value->get<std::string>();
}

void apply_filter(const std::string& filter, std::string& decoded, std::size_t count, std::size_t stride,
                  const std::string& place) {
  if (filter == "NONE") return;
  const bool suits = filter == "OCTAHEDRAL"    ? stride == 4 || stride == 8
                     : filter == "QUATERNION"  ? stride == 8
                     : filter == "EXPONENTIAL" ? stride % 4 == 0
                                               : false;
  if (!suits) {
    throw Error(code::kMeshSyntax, fmt::format("the filter {} does not suit a stride of {}", printable(filter), stride),
                place);
  }
  if (filter == "OCTAHEDRAL") meshopt_decodeFilterOct(decoded.data(), count, stride);
  if (filter == "QUATERNION") meshopt_decodeFilterQuat(decoded.data(), count, stride);
  if (filter == "EXPONENTIAL") meshopt_decodeFilterExp(decoded.data(), count, stride);
}

}  // namespace

std::string decode_meshopt(const Json& extension, std::string_view compressed, std::size_t length,
                           const std::string& place) {
  const std::size_t count = size_member(extension, "count", place);
  const std::size_t stride = size_member(extension, "byteStride", place);
  const std::string mode = text_member(extension, "mode", "", place);
  const std::string filter = text_member(extension, "filter", "NONE", place);
  const bool are_vertices = mode == "ATTRIBUTES";
  if (!are_vertices && mode != "TRIANGLES" && mode != "INDICES") {
    throw Error(code::kMeshSyntax, "the mode of compression must be ATTRIBUTES, TRIANGLES or INDICES", place);
  }
  const bool suits = are_vertices ? stride % 4 == 0 && stride > 0 && stride <= 256 : stride == 2 || stride == 4;
  if (!suits || (mode == "TRIANGLES" && count % 3 != 0)) {
    throw Error(code::kMeshSyntax,
                fmt::format("the mode {} does not suit {} elements of {} bytes", mode, count, stride), place);
  }
  if (count > length / stride || count * stride != length || length / kMostBytesPerByte > compressed.size()) {
    throw Error(code::kMeshCountMismatch,
                fmt::format("{} compressed bytes do not hold {} elements of {} bytes in {}", compressed.size(), count,
                            stride, length),
                place);
  }
  std::string decoded(length, '\0');
  const auto* const bytes = reinterpret_cast<const unsigned char*>(compressed.data());
  const int fault = are_vertices ? meshopt_decodeVertexBuffer(decoded.data(), count, stride, bytes, compressed.size())
                    : mode == "TRIANGLES"
                        ? meshopt_decodeIndexBuffer(decoded.data(), count, stride, bytes, compressed.size())
                        : meshopt_decodeIndexSequence(decoded.data(), count, stride, bytes, compressed.size());
  if (fault != 0) throw Error(code::kMeshSyntax, "the compressed data is damaged", place);
  apply_filter(filter, decoded, count, stride, place);
  return decoded;
}

}  // namespace crease::gltf
