#include "server/store/checked_files.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>

namespace creased {
namespace code = crease::code;

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

/// Compares the content when the file has changed since the last time.
CheckedFiles::State CheckedFiles::state_of(const OpenFile& file, std::string_view id, std::string_view name) {
  constexpr std::size_t kMostRemembered = 10'000;
  const std::string key = fmt::format("{}/{}", id, name);
  const Stamp stamp = stamp_of(file.descriptor.get());
  {
    const std::lock_guard lock(mutex_);
    const auto known = sound_.find(key);
    if (known != sound_.end() && known->second == stamp) return State::kSound;
  }
  const auto record = store_.file_record(id, name);
  if (!record) return State::kUnknown;
  if (digest_of(file.descriptor.get(), key) != FileDigest{record->bytes, record->sha256}) return State::kDamaged;
  const std::lock_guard lock(mutex_);
  if (sound_.size() >= kMostRemembered) sound_.clear();
  sound_[key] = stamp;
  return State::kSound;
}

std::shared_ptr<const OpenFile> CheckedFiles::open(std::string_view id, std::string_view name) {
  auto file = store_.open(id, name);
  if (file == nullptr) return nullptr;
  const State state = state_of(*file, id, name);
  if (state == State::kDamaged) spdlog::error("{} of job {} is damaged and is made again", name, id);
  return state == State::kSound ? file : nullptr;
}

std::shared_ptr<const OpenFile> CheckedFiles::require(std::string_view id, std::string_view name) {
  auto file = store_.open(id, name);
  if (file == nullptr) {
    throw crease::Error(code::kResultDamaged, fmt::format("the file {} of the job is missing", name));
  }
  if (state_of(*file, id, name) == State::kDamaged) {
    throw crease::Error(
        code::kResultDamaged,
        fmt::format("the file {} of the job is not what the job has written; submit the mesh again", name));
  }
  return file;
}

}  // namespace creased
