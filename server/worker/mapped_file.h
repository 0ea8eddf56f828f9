#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

namespace creased {

/// The bytes of a file, read through the page cache as they are touched: they count for nobody's heap.
class MappedFile {
 public:
  /// \throw Error store_unavailable; std::bad_alloc when the address space is too small for it
  explicit MappedFile(const std::filesystem::path& path);
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  std::string_view bytes() const { return bytes_; }

 private:
  std::string_view bytes_;
};

inline std::optional<std::string_view> bytes_of(const std::optional<MappedFile>& file) {
  return file ? std::optional(file->bytes()) : std::nullopt;
}

}  // namespace creased
