#pragma once

#include <optional>
#include <string_view>

namespace creased {

/// A file mapped into memory. Its pages are read when they are accessed and do not count as heap.
class MappedFile {
 public:
  /// Maps an open descriptor, which may be closed afterwards.
  /// \throw Error store_unavailable, upload_damaged; std::bad_alloc when the address space is too small
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
