#include "server/store/durable_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "server/store/failure.h"

namespace creased {

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  if (this != &other) {
    close();
    number_ = other.release();
  }
  return *this;
}

int Descriptor::release() { return std::exchange(number_, -1); }

void Descriptor::close() {
  if (open()) ::close(release());
}

bool write_all(int file, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(file, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

Descriptor open_to_read(const std::filesystem::path& path) {
  Descriptor descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!descriptor.open()) throw file_failure("open", path);
  return descriptor;
}

void sync_path(const std::filesystem::path& path) {
  const Descriptor descriptor = open_to_read(path);
  if (::fsync(descriptor.get()) != 0) throw file_failure("sync", path);
}

ReplacingFile::ReplacingFile(std::filesystem::path path, std::string_view suffix)
    : path_(std::move(path)), partial_(path_) {
  partial_ += ".";
  partial_ += suffix;
  descriptor_ = Descriptor(::open(partial_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600));
  if (!descriptor_.open()) throw file_failure("write", partial_);
}

ReplacingFile::~ReplacingFile() {
  if (!committed_) ::unlink(partial_.c_str());
}

void ReplacingFile::commit(Durability durability) {
  if (durability != Durability::kNone && ::fsync(descriptor_.get()) != 0) throw file_failure("sync", partial_);
  descriptor_.close();
  if (::rename(partial_.c_str(), path_.c_str()) != 0) throw file_failure("rename", partial_);
  committed_ = true;
  if (durability == Durability::kWhole) sync_path(path_.parent_path());
}

}  // namespace creased
