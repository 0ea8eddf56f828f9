#include "server/http/result_files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <google/protobuf/io/zero_copy_stream_impl.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "core/error.h"
#include "proto/convert.h"

namespace creased {
namespace {

using crease::Error;
using crease::Format;
using crease::LabelledMesh;

crease::v1::LabelledMesh read_message(const std::filesystem::path& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!file.open()) throw Error("store_unavailable", "the result of the job cannot be opened");
  google::protobuf::io::FileInputStream stream(file.get());
  crease::v1::LabelledMesh message;
  if (!message.ParseFromZeroCopyStream(&stream)) throw Error("store_unavailable", "the result of the job is damaged");
  return message;
}

LabelledMesh read_result(const std::filesystem::path& path) { return crease::from_message(read_message(path)); }

LabelledMesh read_measured(const std::filesystem::path& path) {
  auto message = read_message(path);
  if (message.measured_size() != message.positions_size()) {
    throw Error("not_found", "the job was made by a version that did not keep the measured positions");
  }
  message.mutable_positions()->Swap(message.mutable_measured());
  return crease::from_message(message);
}

class Encoding {
 public:
  explicit Encoding(std::counting_semaphore<>& encoders) : encoders_(encoders) { encoders_.acquire(); }
  ~Encoding() { encoders_.release(); }
  Encoding(const Encoding&) = delete;
  Encoding& operator=(const Encoding&) = delete;

 private:
  std::counting_semaphore<>& encoders_;
};

nlohmann::ordered_json extras(const crease::v1::Job& job) {
  return crease::mesh_extras(crease::job_fingerprint(job.input(), job.parameters()), job.parameters(),
                             crease::from_message(job.input()), crease::from_message(job.result()));
}

}  // namespace

/// The exclusive right to make one file. The constructor waits while another thread makes it.
class ResultFiles::Turn {
 public:
  Turn(ResultFiles& files, std::string key) : files_(files), key_(std::move(key)) {
    std::unique_lock lock(files_.mutex_);
    files_.finished_.wait(lock, [this] { return files_.under_way_.insert(key_).second; });
  }
  ~Turn() {
    const std::lock_guard lock(files_.mutex_);
    files_.under_way_.erase(key_);
    files_.finished_.notify_all();
  }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

 private:
  ResultFiles& files_;
  std::string key_;
};

std::shared_ptr<const OpenFile> ResultFiles::mesh(const crease::v1::Job& job, const Format& format) {
  return kept(job, fmt::format("mesh.{}", format.name),
              [&](const LabelledMesh& result) { return format.write(result, extras(job)); });
}

std::shared_ptr<const OpenFile> ResultFiles::measured(const crease::v1::Job& job, const Format& format) {
  const Encoding encoding(encoders_);
  const LabelledMesh mesh = read_measured(store_.file_path(job.id(), file::kResult));
  return unkept(format.write(mesh, extras(job)));
}

std::shared_ptr<const OpenFile> ResultFiles::snapshot(const crease::v1::Job& job, const Format& format) {
  const auto source = store_.file_path(job.id(), file::kSnapshot);
  if (!std::filesystem::exists(source)) throw Error("snapshot_unavailable", "the job has not written a snapshot yet");
  return passing(source, [&](const LabelledMesh& result) { return format.write(result, extras(job)); });
}

std::shared_ptr<const OpenFile> ResultFiles::labels(const crease::v1::Job& job, const Format& format, double min) {
  const auto encode = [&](const LabelledMesh& result) { return format.write_labels(result, min); };
  if (min > 0) return passing(store_.file_path(job.id(), file::kResult), encode);
  return kept(job, fmt::format("labels.{}", format.name), encode);
}

std::shared_ptr<const OpenFile> ResultFiles::ridges(const crease::v1::Job& job, const Format& format) {
  return kept(job, fmt::format("ridges.{}", format.name),
              [&](const LabelledMesh& result) { return format.write_ridges(result, extras(job)); });
}

std::shared_ptr<const OpenFile> ResultFiles::kept(const crease::v1::Job& job, const std::string& name,
                                                  const Encode& encode) {
  const auto path = store_.file_path(job.id(), name);
  if (auto file = open_file(path)) return file;
  const Turn turn(*this, job.id() + "/" + name);
  if (auto file = open_file(path)) return file;
  const Encoding encoding(encoders_);
  try {
    const std::string bytes = encode(read_result(store_.file_path(job.id(), file::kResult)));
    if (!store_.charge(job.id(), bytes.size())) return unkept(bytes);
    ReplacingFile target(path, "part");
    if (!write_all(target.descriptor(), bytes)) throw file_failure("write", path);
    target.commit(Durability::kWhole);
    if (auto file = open_file(path)) return file;
  } catch (const Error&) {
    if (store_.find(job.id())) throw;
  }
  throw Error("job_not_found", "the job was removed");
}

std::shared_ptr<const OpenFile> ResultFiles::passing(const std::filesystem::path& source, const Encode& encode) {
  const Encoding encoding(encoders_);
  return unkept(encode(read_result(source)));
}

/// A nameless file that vanishes with its last reader, for content that is not kept.
std::shared_ptr<const OpenFile> ResultFiles::unkept(const std::string& bytes) {
  const auto path = store_.temporary_path();
  const Descriptor file(::open(path.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0600));
  if (!file.open()) throw file_failure("create", path);
  if (!write_all(file.get(), bytes)) throw file_failure("write", path);
  auto opened = open_file(path);
  std::error_code ignored;
  std::filesystem::remove(path, ignored);
  return opened;
}

}  // namespace creased
