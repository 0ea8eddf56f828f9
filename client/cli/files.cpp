#include "client/cli/files.h"

#include <fmt/format.h>
#include <unistd.h>

#include <sstream>
#include <system_error>

#include "client/cli/failure.h"

namespace crease::client {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void unwritable(const fs::path& path) {
  throw Failure(code::kFileUnwritable, fmt::format("cannot write {}", path.string()));
}

}  // namespace

std::string read_file(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::ostringstream bytes;
  if (!stream || fs::is_directory(path) || (stream.peek() != EOF && !(bytes << stream.rdbuf()))) {
    throw Failure(code::kFileUnreadable, fmt::format("cannot read {}", path.string()));
  }
  return std::move(bytes).str();
}

OutputFile::OutputFile(fs::path path)
    : path_(std::move(path)),
      temporary_(fmt::format("{}.{}.part", path_.string(), ::getpid())),
      stream_(temporary_, std::ios::binary) {
  if (!stream_ || fs::is_directory(path_)) {
    std::error_code ignored;
    fs::remove(temporary_, ignored);
    unwritable(path_);
  }
}

OutputFile::~OutputFile() {
  if (committed_) return;
  stream_.close();
  std::error_code ignored;
  fs::remove(temporary_, ignored);
}

bool OutputFile::write(std::string_view bytes) {
  return static_cast<bool>(stream_.write(bytes.data(), static_cast<std::streamsize>(bytes.size())));
}

void OutputFile::commit() {
  stream_.close();
  if (!stream_) unwritable(path_);
  std::error_code error;
  fs::rename(temporary_, path_, error);
  if (error) unwritable(path_);
  committed_ = true;
}

void write_file(const fs::path& path, std::string_view bytes) {
  OutputFile file(path);
  if (!file.write(bytes)) unwritable(path);
  file.commit();
}

const Format& output_format(const std::string& name, const fs::path& path) {
  const Formats formats = formats_with(&Format::write);
  const Format* format = name.empty() ? find_by_filename(formats, path.string()) : find_by_name(formats, name);
  if (format != nullptr) return *format;
  const std::string what = name.empty() ? fmt::format("the extension of {}", path.string()) : fmt::format("'{}'", name);
  throw Error(code::kOutputFormatUnknown, fmt::format("{} is not an output format; use {}", what, name_list(formats)));
}

}  // namespace crease::client
