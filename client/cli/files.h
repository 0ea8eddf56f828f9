#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "core/io/mesh_format.h"

namespace crease::client {

/// \throw Failure file_unreadable
std::string read_file(const std::filesystem::path& path);

/// A file that appears whole or not at all: written beside its place under another name, then renamed.
class OutputFile {
 public:
  /// \throw Failure file_unwritable
  explicit OutputFile(std::filesystem::path path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// False when the disk is full or gone.
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

/// The format called `name`, or with an empty name that of the file's extension.
/// \throw Error output_format_unknown
MeshFormat output_format(const std::string& name, const std::filesystem::path& path);

}  // namespace crease::client
