#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace crease {

inline constexpr std::uint32_t kGlbJson = 0x4e4f534a, kGlbBinary = 0x004e4942;

/// Fills up to a multiple of four bytes.
void pad_chunk(std::string& chunk, char with);

/// Appends a chunk, which is padded, to the chunks of a GLB file.
void append_chunk(std::string& chunks, std::string_view chunk, std::uint32_t type);

/// A GLB file of a JSON chunk and, unless that is empty, a binary one. \throw Error mesh_too_large beyond 32 bits
std::string glb_file(std::string json, std::string_view binary);

}  // namespace crease
