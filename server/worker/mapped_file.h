#pragma once

#include <optional>
#include <string_view>

namespace creased {

/// The bytes of a file, read through the page cache as they are touched: they count for nobody's heap.
class MappedFile {
 public:
  /// Of an open descriptor, which may be closed at once.
  /// \throw Error store_unavailable; std::bad_alloc when the address space is too small for it
  explicit MappedFile(int file);
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
