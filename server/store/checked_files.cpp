#include "server/store/checked_files.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include "proto/convert.h"

namespace creased {

CheckedFiles::Stamp CheckedFiles::stamp_of(int file) {
  struct stat status {};
  if (::fstat(file, &status) != 0) throw file_failure("read", "a file of the job");
  return {static_cast<std::int64_t>(status.st_dev),
          static_cast<std::int64_t>(status.st_ino),
          std::int64_t{status.st_size},
          std::int64_t{status.st_mtim.tv_sec},
          std::int64_t{status.st_mtim.tv_nsec},
          std::int64_t{status.st_ctim.tv_sec},
          std::int64_t{status.st_ctim.tv_nsec}};
}

std::shared_ptr<const OpenFile> CheckedFiles::open(std::string_view id, std::string_view name) {
  constexpr std::size_t kMostRemembered = 10'000;
  const auto path = store_.file_path(id, name);
  auto file = open_file(path);
  if (file == nullptr) return nullptr;
  const Stamp stamp = stamp_of(file->descriptor.get());
  {
    const std::lock_guard lock(mutex_);
    const auto known = sound_.find(path.string());
    if (known != sound_.end() && known->second == stamp) return file;
  }
  const auto record = store_.file_record(id, name);
  if (!record) return nullptr;
  if (digest_of(file->descriptor.get(), path) != FileDigest{record->bytes, record->sha256}) {
    spdlog::error("{} is damaged and is made again", path.string());
    return nullptr;
  }
  const std::lock_guard lock(mutex_);
  if (sound_.size() >= kMostRemembered) sound_.clear();
  sound_[path.string()] = stamp;
  return file;
}

std::string CheckedFiles::read(std::string_view id, std::string_view name) {
  const auto path = store_.file_path(id, name);
  const auto file = open_file(path);
  if (file == nullptr)
    throw crease::Error(code::kResultDamaged, fmt::format("the file {} of the job is missing", name));
  std::string bytes = read_whole(file->descriptor.get(), path);
  const auto record = store_.file_record(id, name);
  if (record && (record->bytes != bytes.size() || record->sha256 != crease::sha256_hex(bytes))) {
    throw crease::Error(
        code::kResultDamaged,
        fmt::format("the file {} of the job is not what the job has written; submit the mesh again", name));
  }
  return bytes;
}

}  // namespace creased
