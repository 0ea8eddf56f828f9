#include "server/api/result_files.h"

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

crease::v1::LabelledMesh parse_message(const std::string& bytes) {
  crease::v1::LabelledMesh message;
  if (bytes.empty() || !message.ParseFromString(bytes)) {
    throw Error(code::kResultDamaged, "the result of the job cannot be read");
  }
  return message;
}

LabelledMesh parse_result(const std::string& bytes) { return crease::from_message(parse_message(bytes)); }

LabelledMesh parse_measured(const std::string& bytes) {
  auto message = parse_message(bytes);
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

LabelledMesh ResultFiles::result_of(const std::string& id) { return parse_result(checked_.read(id, file::kResult)); }

std::shared_ptr<const OpenFile> ResultFiles::measured(const crease::v1::Job& job, const Format& format) {
  const Encoding encoding(encoders_);
  return unkept(format.write(parse_measured(checked_.read(job.id(), file::kResult)), extras(job)));
}

std::shared_ptr<const OpenFile> ResultFiles::snapshot(const crease::v1::Job& job, const Format& format) {
  const auto source = open_file(store_.file_path(job.id(), file::kSnapshot));
  if (source == nullptr) throw Error("snapshot_unavailable", "the job has not written a snapshot yet");
  const Encoding encoding(encoders_);
  return unkept(
      format.write(parse_result(read_whole(source->descriptor.get(), "the snapshot of the job")), extras(job)));
}

std::shared_ptr<const OpenFile> ResultFiles::labels(const crease::v1::Job& job, const Format& format, double min) {
  const auto encode = [&](const LabelledMesh& result) { return format.write_labels(result, min); };
  if (min <= 0) return kept(job, fmt::format("labels.{}", format.name), encode);
  const Encoding encoding(encoders_);
  return unkept(encode(result_of(job.id())));
}

std::shared_ptr<const OpenFile> ResultFiles::ridges(const crease::v1::Job& job, const Format& format) {
  return kept(job, fmt::format("ridges.{}", format.name),
              [&](const LabelledMesh& result) { return format.write_ridges(result, extras(job)); });
}

std::shared_ptr<const OpenFile> ResultFiles::kept(const crease::v1::Job& job, const std::string& name,
                                                  const Encode& encode) {
  if (auto file = checked_.open(job.id(), name)) return file;
  const Turn turn(*this, job.id() + "/" + name);
  if (auto file = checked_.open(job.id(), name)) return file;
  const Encoding encoding(encoders_);
  try {
    const auto path = store_.file_path(job.id(), name);
    const std::string bytes = encode(result_of(job.id()));
    // Of what is written here nothing depends on reaching the disk: it can be made again.
    if (!store_.keep_file(job.id(), {name, bytes.size(), crease::sha256_hex(bytes)})) return unkept(bytes);
    ReplacingFile target(path, "part");
    if (!write_all(target.descriptor(), bytes)) throw file_failure("write", path);
    target.commit(Durability::kNone);
    if (auto file = open_file(path)) return file;
  } catch (const Error&) {
    if (store_.find(job.id())) throw;
  }
  throw Error("job_not_found", "the job was removed");
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
