#include "core/io/glb.h"

#include <limits>

#include "core/error.h"
#include "core/io/write_number.h"

namespace crease {

void pad_chunk(std::string& chunk, char with) {
  while (chunk.size() % 4 != 0) chunk += with;
}

void append_chunk(std::string& chunks, std::string_view chunk, std::uint32_t type) {
  append_little_endian(chunks, static_cast<std::uint32_t>(chunk.size()));
  append_little_endian(chunks, type);
  chunks += chunk;
}

std::string glb_file(std::string json, std::string_view binary) {
  constexpr std::size_t kHeadBytes = 12, kChunkHeadBytes = 8;
  pad_chunk(json, ' ');
  const std::size_t size =
      kHeadBytes + kChunkHeadBytes + json.size() + (binary.empty() ? 0 : kChunkHeadBytes + binary.size());
  if (size > std::numeric_limits<std::uint32_t>::max()) {
    throw Error(code::kMeshTooLarge, "the mesh is too large for a glTF file");
  }
  std::string file = "glTF";
  file.reserve(size);
  append_little_endian(file, std::uint32_t{2});
  append_little_endian(file, static_cast<std::uint32_t>(size));
  append_chunk(file, json, kGlbJson);
  if (!binary.empty()) append_chunk(file, binary, kGlbBinary);
  return file;
}

}  // namespace crease
