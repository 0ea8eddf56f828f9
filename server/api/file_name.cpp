#include "server/api/file_name.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "core/base/text.h"

namespace creased {
namespace {

constexpr std::size_t kMaxBytes = 200;

bool is_plain(unsigned char c) { return c < 0x80 && (std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.'); }

}  // namespace

std::string clean_file_name(std::string_view name) {
  std::string clean = crease::valid_utf8(name.substr(name.find_last_of("/\\") + 1));
  std::erase_if(clean, [](unsigned char c) { return c < 0x20 || c == 0x7f; });
  if (clean.size() > kMaxBytes) {
    std::size_t start = clean.size() - kMaxBytes;  // the extension is at the end
    while (start < clean.size() && (static_cast<unsigned char>(clean[start]) & 0xc0U) == 0x80U) ++start;
    clean.erase(0, start);
  }
  return clean;
}

std::string attachment(const std::string& upload_name, const std::string& fallback, std::string_view part,
                       std::string_view extension) {
  std::string stem = std::filesystem::path(upload_name).stem().string();
  stem.erase(0, stem.find_first_not_of('.'));
  if (stem.empty()) stem = fallback;
  const std::string name = fmt::format("{}-{}.{}", stem, part, extension);
  std::string ascii, encoded;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    ascii += is_plain(byte) ? c : '_';
    encoded += is_plain(byte) ? std::string(1, c) : fmt::format("%{:02X}", byte);
  }
  std::string header = "attachment; filename=\"" + ascii + "\"";
  if (ascii != name) header += "; filename*=UTF-8''" + encoded;
  return header;
}

}  // namespace creased
