#include "server/store/job_files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <random>
#include <system_error>

#include "server/base/durable_file.h"
#include "server/base/failure.h"
#include "server/store/store.h"

namespace creased {
namespace code = crease::code;
namespace fs = std::filesystem;
namespace {

constexpr mode_t kPrivate = 0700;
constexpr std::size_t kLongestId = 64;

void make_folder(const fs::path& path) {
  if (::mkdir(path.c_str(), kPrivate) != 0 && errno != EEXIST) throw file_failure("create", path);
  if (!fs::is_directory(path)) {
    errno = ENOTDIR;
    throw file_failure("use", path);
  }
}

void make_folders(const fs::path& path) {
  fs::path whole;
  for (const auto& part : path) {
    whole /= part;
    if (std::error_code ignored; !fs::is_directory(whole, ignored)) make_folder(whole);
  }
}

/// Takes the folder's rights from others, unless it belongs to another user or is shared by many, like /tmp.
void make_private(const fs::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) throw file_failure("use", path);
  if (status.st_uid != ::geteuid() || (status.st_mode & S_ISVTX) != 0) return;
  if ((status.st_mode & (S_IRWXG | S_IRWXO)) != 0) ::chmod(path.c_str(), kPrivate);
}

bool valid_name(std::string_view name) {
  return !name.empty() && name.front() != '.' && std::ranges::all_of(name, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '.' || c == '-' || c == '_';
  });
}

/// Removes a folder with its content. Another process may be removing the same folder, so files that vanish are not an
/// error.
void remove_tree(const fs::path& path) {
  std::error_code failed;
  do {
    fs::remove_all(path, failed);
  } while (failed == std::errc::no_such_file_or_directory);
  if (!failed) return;
  errno = failed.value();
  throw file_failure("remove", path);
}

bool untouched_for(const fs::path& path, std::chrono::seconds age) {
  std::error_code failed;
  const auto touched = fs::last_write_time(path, failed);
  return !failed && fs::file_time_type::clock::now() - touched > age;
}

}  // namespace

JobFiles::JobFiles(const fs::path& data_dir)
    : jobs_(data_dir / "jobs"), incoming_(data_dir / "incoming"), ballast_(data_dir / "ballast") {
  make_folders(fs::absolute(data_dir));
  make_private(data_dir);
  make_folder(jobs_);
  make_folder(incoming_);
}

bool JobFiles::valid_id(std::string_view id) {
  return !id.empty() && id.size() <= kLongestId &&
         std::ranges::all_of(id, [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || c == '-'; });
}

fs::path JobFiles::folder(std::string_view id) const {
  if (!valid_id(id)) throw crease::Error(code::kJobNotFound, "not a valid job id");
  return jobs_ / id;
}

fs::path JobFiles::path(std::string_view id, std::string_view name) const {
  if (!valid_name(name)) throw crease::Error(code::kJobNotFound, "not a valid name for a job's file");
  return folder(id) / name;
}

fs::path JobFiles::temporary_path() const {
  std::random_device random;
  std::array<std::uint32_t, 3> words{};
  std::ranges::generate(words, std::ref(random));
  return incoming_ / fmt::format("{:08x}", fmt::join(words, ""));
}

bool JobFiles::reserve(std::string_view id) const {
  const fs::path path = folder(id);
  if (::mkdir(path.c_str(), kPrivate) == 0) return true;
  if (errno == EEXIST) return false;
  throw file_failure("create", path);
}

void JobFiles::adopt(std::string_view id, const fs::path& source, std::string_view name) const {
  sync_path(source);
  const fs::path target = path(id, name);
  if (::rename(source.c_str(), target.c_str()) != 0) throw file_failure("take over", source);
  sync_path(target.parent_path());
  sync_path(jobs_);
}

void JobFiles::remove_working_files(std::string_view id) const {
  std::error_code ignored;
  for (const auto name : {file::kCheckpoint, file::kSnapshot}) fs::remove(path(id, name), ignored);
  for (const auto& entry : fs::directory_iterator(folder(id), ignored)) {
    if (entry.path().extension() == ".part") fs::remove(entry.path(), ignored);
  }
}

std::int64_t JobFiles::bytes(std::string_view id) const {
  std::int64_t sum = 0;
  std::error_code failed;
  for (fs::directory_iterator entry(folder(id), failed), end; !failed && entry != end; entry.increment(failed)) {
    std::error_code gone;
    const auto size = entry->file_size(gone);
    if (!gone) sum += static_cast<std::int64_t>(size);
  }
  return sum;
}

JobFiles::Room JobFiles::room() const {
  struct statvfs disk {};
  if (::statvfs(jobs_.c_str(), &disk) != 0) throw file_failure("use", jobs_);
  return {std::uint64_t{disk.f_bavail} * disk.f_frsize, std::uint64_t{disk.f_blocks} * disk.f_frsize};
}

std::uint64_t JobFiles::Room::reserve() const {
  constexpr std::uint64_t kMost = 64U << 20U, kPart = 20;
  return std::min(kMost, total / kPart);
}

void JobFiles::discard(std::string_view id) const {
  // The name contains the id, so that the rest can be found if this process is killed.
  const fs::path source = folder(id), target = incoming_ / fmt::format("removed-{}", id);
  remove_tree(target);
  if (::rename(source.c_str(), target.c_str()) == 0) {
    sync_path(jobs_);
    remove_tree(target);
  } else if (errno != ENOENT) {
    throw file_failure("remove", source);
  }
  sync_path(incoming_);
}

void JobFiles::probe() const {
  const fs::path path = temporary_path();
  ReplacingFile file(path, "probe");
  const std::array<char, 4096> block{};
  if (::write(file.descriptor(), block.data(), block.size()) != static_cast<ssize_t>(block.size())) {
    throw file_failure("write", path);
  }
  if (::fsync(file.descriptor()) != 0) throw file_failure("sync", path);
}

void JobFiles::clean_leftovers(const std::unordered_set<std::string>& known_ids, std::chrono::seconds age) const {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(incoming_)) {
    if (untouched_for(entry.path(), age)) fs::remove_all(entry.path(), ignored);
  }
  for (const std::string& id : ids()) {
    // A folder with an upload or the record of an accepted job is for the recovery at the next start, not for the bin.
    if (known_ids.contains(id) || fs::exists(path(id, file::kAccepted)) || fs::exists(path(id, file::kUpload)))
      continue;
    if (untouched_for(folder(id), age)) discard(id);
  }
}

std::vector<std::string> JobFiles::ids() const {
  std::vector<std::string> ids;
  for (const auto& entry : fs::directory_iterator(jobs_)) {
    if (const std::string id = entry.path().filename(); valid_id(id)) ids.push_back(id);
  }
  std::ranges::sort(ids);
  return ids;
}

bool JobFiles::free_ballast() const {
  std::error_code failed;
  return fs::remove(ballast_, failed) && !failed;
}

void JobFiles::take_ballast() const {
  constexpr off_t kBytes = 4 << 20;
  const auto now = room();
  if (fs::exists(ballast_) || now.free < now.reserve() + kBytes) return;
  const Descriptor file(::open(ballast_.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0600));
  if (file.open() && ::posix_fallocate(file.get(), 0, kBytes) != 0) free_ballast();
}

}  // namespace creased
