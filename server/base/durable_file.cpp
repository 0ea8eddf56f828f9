#include "server/base/durable_file.h"

#include <fcntl.h>
#include <openssl/evp.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <memory>
#include <new>
#include <utility>

#include "core/base/text.h"
#include "server/base/failure.h"

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
  Descriptor descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!descriptor.open()) throw file_failure("open", path);
  return descriptor;
}

std::shared_ptr<const OpenFile> open_file(const std::filesystem::path& path) {
  Descriptor descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!descriptor.open() && (errno == ENOENT || errno == ENOTDIR)) return nullptr;
  struct stat status {};
  if (!descriptor.open() || ::fstat(descriptor.get(), &status) != 0) throw file_failure("open", path);
  return std::make_shared<const OpenFile>(OpenFile{std::move(descriptor), static_cast<std::uint64_t>(status.st_size)});
}

std::string read_whole(const std::filesystem::path& path) { return read_whole(open_to_read(path).get(), path); }

std::string read_whole(int file, const std::filesystem::path& path) {
  struct stat status {};
  if (::fstat(file, &status) != 0) throw file_failure("read", path);
  std::string bytes(static_cast<std::size_t>(status.st_size), '\0');
  std::size_t have = 0;
  while (have < bytes.size()) {
    const ssize_t count = ::pread(file, bytes.data() + have, bytes.size() - have, static_cast<off_t>(have));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw file_failure("read", path);
    if (count == 0) break;  // it was cut meanwhile
    have += static_cast<std::size_t>(count);
  }
  bytes.resize(have);
  return bytes;
}

FileDigest digest_of(int file, const std::filesystem::path& path) {
  constexpr std::size_t kPiece = 256 * 1024;
  const std::unique_ptr<EVP_MD_CTX, decltype(&::EVP_MD_CTX_free)> hash(::EVP_MD_CTX_new(), &::EVP_MD_CTX_free);
  if (hash == nullptr || ::EVP_DigestInit_ex(hash.get(), ::EVP_sha256(), nullptr) != 1) throw std::bad_alloc();
  FileDigest digest;
  std::string piece(kPiece, '\0');
  for (;;) {
    const ssize_t count = ::pread(file, piece.data(), piece.size(), static_cast<off_t>(digest.bytes));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw file_failure("read", path);
    if (count == 0) break;
    ::EVP_DigestUpdate(hash.get(), piece.data(), static_cast<std::size_t>(count));
    digest.bytes += static_cast<std::uint64_t>(count);
  }
  std::array<unsigned char, EVP_MAX_MD_SIZE> bytes{};
  unsigned size = 0;
  ::EVP_DigestFinal_ex(hash.get(), bytes.data(), &size);
  digest.sha256 = crease::hex({bytes.data(), size});
  return digest;
}

namespace {

bool sync(int file) {
  int result = -1;
  do {
    result = ::fsync(file);
  } while (result != 0 && errno == EINTR);
  return result == 0;
}

}  // namespace

void sync_path(const std::filesystem::path& path) {
  const Descriptor descriptor = open_to_read(path);
  if (!sync(descriptor.get())) throw file_failure("sync", path);
}

ReplacingFile::ReplacingFile(std::filesystem::path path, std::string_view suffix)
    : path_(std::move(path)), partial_(path_) {
  partial_ += ".";
  partial_ += suffix;
  descriptor_ = Descriptor(::open(partial_.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600));
  if (!descriptor_.open()) throw file_failure("write", partial_);
}

ReplacingFile::~ReplacingFile() {
  if (!committed_) ::unlink(partial_.c_str());
}

void ReplacingFile::commit(Durability durability) {
  if (durability != Durability::kNone && !sync(descriptor_.get())) throw file_failure("sync", partial_);
  descriptor_.close();
  if (::rename(partial_.c_str(), path_.c_str()) != 0) throw file_failure("rename", partial_);
  committed_ = true;
  if (durability == Durability::kWhole) sync_path(path_.parent_path());
}

}  // namespace creased
