#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "core/io/formats.h"

namespace crease::client {

/// \throw Failure file_unreadable
std::string read_file(const std::filesystem::path& path);

/// A file that appears complete or not at all. It is written under a temporary name and then renamed.
class OutputFile {
 public:
  /// \throw Failure file_unwritable
  explicit OutputFile(std::filesystem::path path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Returns false when writing fails, for example on a full disk.
  bool write(std::string_view bytes);
  /// \throw Failure file_unwritable
  void commit();

 private:
  std::filesystem::path path_, temporary_;
  std::ofstream stream_;
  bool committed_ = false;
};

/// \throw Failure file_unwritable
void write_file(const std::filesystem::path& path, std::string_view bytes);

/// The format called `name`, or the format of the file's extension when `name` is empty.
/// \throw Error output_format_unknown
const Format& output_format(const std::string& name, const std::filesystem::path& path);

}  // namespace crease::client
