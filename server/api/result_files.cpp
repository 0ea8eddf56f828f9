#include "server/api/result_files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <system_error>
#include <utility>

#include "core/base/text.h"
#include "proto/assembly.h"
#include "proto/result_formats.h"
#include "server/base/failure.h"

namespace creased {
namespace code = crease::code;
namespace v1 = crease::v1;
namespace fs = std::filesystem;
namespace {

using crease::Error;

constexpr std::chrono::milliseconds kLookEvery{100};

/// "mesh", "measured", …
std::string word_of(v1::ResultPart part) {
  constexpr std::string_view kPrefix = "RESULT_PART_";
  return crease::lower(v1::ResultPart_Name(part).substr(kPrefix.size()));
}

/// Whether the file has something of the upload.
bool reads_upload(const v1::Job& job, const ResultFile& wanted) {
  const bool is_mesh = wanted.part == v1::RESULT_PART_MESH || wanted.part == v1::RESULT_PART_MEASURED ||
                       wanted.part == v1::RESULT_PART_SNAPSHOT;
  return wanted.original || (is_mesh && crease::takes_over(job.input(), wanted.format));
}

std::string_view format_of(const ResultFile& wanted) {
  return wanted.original ? crease::kOriginal : wanted.format.name;
}

std::string name_of(const ResultFile& wanted) {
  const std::string filter = wanted.min_label > 0 ? fmt::format("-{}", wanted.min_label) : "";
  return fmt::format("{}{}{}.{}", word_of(wanted.part), filter, style_suffix(wanted.style), format_of(wanted));
}

/// A snapshot changes, and few ask for a part of the labels or the measured mesh twice.
bool is_kept(const ResultFile& wanted) {
  return wanted.part != v1::RESULT_PART_SNAPSHOT && wanted.part != v1::RESULT_PART_MEASURED && wanted.min_label <= 0;
}

v1::EncodeTask task_of(const v1::Job& job, const ResultFile& wanted) {
  v1::EncodeTask task;
  *task.mutable_job() = job;
  task.set_part(wanted.part);
  task.set_format(std::string(format_of(wanted)));
  task.set_ridge_lines(wanted.style.ridge_lines);
  task.set_compressed(wanted.style.compressed);
  task.set_quantized(wanted.style.quantized);
  task.set_has_upload(reads_upload(job, wanted));
  task.set_min_label(wanted.min_label);
  return task;
}

[[noreturn]] void fail_left() { throw Error(code::kRequestTimeout, "the client left while the file was made"); }

/// Removes a file at the end, wherever that is; nothing when it was renamed.
class Temporary {
 public:
  explicit Temporary(fs::path path) : path_(std::move(path)) {}
  ~Temporary() {
    std::error_code ignored;
    fs::remove(path_, ignored);
  }
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;

 private:
  fs::path path_;
};

}  // namespace

std::string style_suffix(const crease::MeshStyle& style) {
  return fmt::format("{}{}{}", style.ridge_lines ? "-ridges" : "", style.compressed ? "-meshopt" : "",
                     style.quantized ? "-quantized" : "");
}

std::shared_ptr<const OpenFile> ResultFiles::file(const v1::Job& job, const ResultFile& wanted,
                                                  const TaskPool::Asker& asker) {
  if (wanted.part == v1::RESULT_PART_REPORT && &wanted.format == &crease::kProtobuf) return source(job, wanted.part);
  const std::string name = name_of(wanted), key = job.id() + "/" + name;
  for (;;) {
    if (auto kept = is_kept(wanted) ? checked_.open(job.id(), name) : nullptr) return kept;
    std::unique_lock lock(mutex_);
    auto& entry = under_way_[key];
    if (entry == nullptr) {
      entry = std::make_shared<UnderWay>();
      const auto mine = entry;
      lock.unlock();
      return lead(*mine, key, job, wanted, asker);
    }
    const auto others = entry;
    if (others->askers > 0) return join(lock, *others, asker);
    changed_.wait(lock, [&] { return others->ended; });  // all have left, and it is being stopped
  }
}

std::size_t ResultFiles::askers(const std::string& job, const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto entry = under_way_.find(job + "/" + name);
  return entry == under_way_.end() ? 0 : entry->second->askers;
}

/// Encodes for all who ask.
std::shared_ptr<const OpenFile> ResultFiles::lead(UnderWay& mine, const std::string& key, const v1::Job& job,
                                                  const ResultFile& wanted, const TaskPool::Asker& asker) {
  bool left = false;
  const auto all_left = [&] {
    const std::lock_guard lock(mutex_);
    if (!left && asker.left && asker.left()) {
      left = true;
      --mine.askers;
    }
    return mine.askers == 0;
  };
  std::shared_ptr<const OpenFile> made;
  std::exception_ptr error;
  try {
    made = encode(job, wanted, {asker.owner, all_left});
  } catch (...) {
    error = std::current_exception();
  }
  {
    const std::lock_guard lock(mutex_);
    mine.ended = true;
    mine.file = made;
    mine.error = error;
    under_way_.erase(key);
  }
  changed_.notify_all();
  if (error != nullptr) std::rethrow_exception(error);
  return made;
}

/// Waits for the encoding that another has begun.
std::shared_ptr<const OpenFile> ResultFiles::join(std::unique_lock<std::mutex>& lock, UnderWay& others,
                                                  const TaskPool::Asker& asker) {
  ++others.askers;
  while (!others.ended) {
    changed_.wait_for(lock, kLookEvery);
    if (others.ended || !asker.left || !asker.left()) continue;
    --others.askers;
    fail_left();
  }
  if (others.error != nullptr) std::rethrow_exception(others.error);
  return others.file;
}

std::shared_ptr<const OpenFile> ResultFiles::source(const v1::Job& job, v1::ResultPart part) {
  if (part != v1::RESULT_PART_SNAPSHOT) {
    return checked_.require(job.id(), part == v1::RESULT_PART_REPORT ? file::kReport : file::kResult);
  }
  auto snapshot = store_.open(job.id(), file::kSnapshot);
  if (snapshot == nullptr) throw Error(code::kSnapshotUnavailable, "the job has not written a snapshot yet");
  return snapshot;
}

std::shared_ptr<const OpenFile> ResultFiles::encode(const v1::Job& job, const ResultFile& wanted,
                                                    const TaskPool::Asker& asker) {
  try {
    const auto stored = source(job, wanted.part);
    const auto path = store_.temporary_path();
    const Descriptor target(::open(path.c_str(), O_CREAT | O_EXCL | O_RDWR | O_CLOEXEC, 0600));
    if (!target.open()) throw file_failure("create", path);
    const Temporary temporary(path);
    const bool has_upload = reads_upload(job, wanted);
    const auto upload = has_upload ? store_.open(job.id(), file::kUpload) : nullptr;
    if (has_upload && upload == nullptr) throw Error(code::kUploadDamaged, "the upload of the job has vanished");
    if (!encoder_.encode(asker, task_of(job, wanted), stored->descriptor.get(), stored->bytes, target.get(),
                         upload == nullptr ? -1 : upload->descriptor.get())) {
      fail_left();
    }
    auto made = open_file(path);
    if (made == nullptr) throw Error(code::kStoreUnavailable, "the file that was made has vanished");
    if (is_kept(wanted)) keep(job.id(), name_of(wanted), path, target.get());
    return made;
  } catch (const Error&) {
    if (store_.find(job.id())) throw;
  }
  throw Error(code::kJobNotFound, "the job was removed");
}

/// Keeps a file beside the job, if there is room. None of it depends on reaching the disk: it can be made again.
void ResultFiles::keep(const std::string& id, const std::string& name, const fs::path& path, int made) {
  try {
    FileDigest digest = digest_of(made, path);
    store_.keep_file(id, {name, digest.bytes, std::move(digest.sha256)}, path);
  } catch (const Error& error) {
    spdlog::warn("job {}: {} is not kept: {}", id, name, error.detail());
  }
}

}  // namespace creased
