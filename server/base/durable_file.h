#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace creased {

/// A file descriptor that closes itself.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() { close(); }
  Descriptor(Descriptor&& other) noexcept : number_(other.release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept;

  int get() const { return number_; }
  bool open() const { return number_ >= 0; }
  int release();
  void close();

 private:
  int number_ = -1;
};

/// An open file. It stays readable when it is renamed or removed.
struct OpenFile {
  Descriptor descriptor;
  std::uint64_t bytes = 0;
};

/// Returns null when there is no such file. \throw Error store_unavailable
std::shared_ptr<const OpenFile> open_file(const std::filesystem::path& path);

/// Writes all of `bytes`. Returns false on an error, with the reason in errno.
bool write_all(int file, std::string_view bytes);

/// Opens a file for reading, without waiting where it is no file. \throw Error store_unavailable
Descriptor open_to_read(const std::filesystem::path& path);

/// The content of a file. \throw Error store_unavailable, also when only a part can be read
std::string read_whole(const std::filesystem::path& path);
std::string read_whole(int file, const std::filesystem::path& path);

/// Size and SHA-256 (64 hexadecimal digits) of the content of a file.
struct FileDigest {
  std::uint64_t bytes = 0;
  std::string sha256;
  bool operator==(const FileDigest&) const = default;
};
/// Reads an open file from its start. \throw Error store_unavailable
FileDigest digest_of(int file, const std::filesystem::path& path);

/// Flushes the content of a file, or the names in a folder, to the disk. \throw Error store_unavailable
void sync_path(const std::filesystem::path& path);

/// What is safely on the disk when a call returns.
enum class Durability {
  kNone,
  kContent,  ///< the content; the name only after the next sync of the folder
  kWhole,
};

/// A file that appears complete or not at all. It is written as NAME.SUFFIX and then renamed. Its folder must exist.
class ReplacingFile {
 public:
  /// \throw Error store_unavailable
  ReplacingFile(std::filesystem::path path, std::string_view suffix);
  ~ReplacingFile();
  ReplacingFile(const ReplacingFile&) = delete;
  ReplacingFile& operator=(const ReplacingFile&) = delete;

  const std::filesystem::path& path() const { return path_; }
  int descriptor() const { return descriptor_.get(); }
  /// Flushes the content as `durability` says and renames the file. \throw Error store_unavailable, storage_full
  void commit(Durability durability);

 private:
  std::filesystem::path path_, partial_;
  Descriptor descriptor_;
  bool committed_ = false;
};

}  // namespace creased
