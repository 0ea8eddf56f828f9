#include "server/http/result_files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <google/protobuf/io/zero_copy_stream_impl.h>
#include <unistd.h>

#include <cerrno>
#include <numbers>
#include <system_error>

#include "core/error.h"
#include "proto/convert.h"

namespace creased {
namespace {

using crease::Error;
using crease::LabelledMesh;

crease::InputFacts facts_of(const crease::v1::InputFacts& message) {
  crease::InputFacts facts;
  facts.vertices = message.vertices();
  facts.faces = message.faces();
  facts.edges = message.edges();
  facts.boundary_edges = message.boundary_edges();
  facts.nonmanifold_edges = message.nonmanifold_edges();
  facts.degenerate_faces = message.degenerate_faces();
  facts.duplicate_faces = message.duplicate_faces();
  facts.isolated_vertices = message.isolated_vertices();
  facts.flipped_faces = message.flipped_faces();
  facts.components = message.components();
  facts.mean_edge_length = message.mean_edge_length();
  facts.noise_sigma = message.noise_sigma();
  return facts;
}

crease::ResultFacts facts_of(const crease::v1::ResultFacts& message) {
  crease::ResultFacts facts;
  facts.ridge_edges = message.ridge_edges();
  facts.ridge_length = message.ridge_length();
  facts.max_displacement = message.max_displacement();
  facts.rms_displacement = message.rms_displacement();
  facts.volume_change = message.volume_change();
  facts.seconds = message.seconds();
  return facts;
}

LabelledMesh read_result(const std::filesystem::path& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!file.open()) throw Error("store_unavailable", "a result cannot be opened");
  google::protobuf::io::FileInputStream stream(file.get());
  crease::v1::LabelledMesh message;
  if (!message.ParseFromZeroCopyStream(&stream)) throw Error("store_unavailable", "a result cannot be read");
  return crease::from_message(message);
}

void write_all(int file, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(file, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw Error("store_unavailable", "cannot keep a result: " + std::generic_category().message(errno));
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
}

std::string encode_labels_protobuf(const LabelledMesh& result, double min) {
  crease::v1::EdgeLabels message;
  for (std::size_t i = 0; i < result.edges.size(); ++i) {
    if (result.labels[i] < min) continue;
    message.add_edges(result.edges[i].v0);
    message.add_edges(result.edges[i].v1);
    message.add_labels(result.labels[i]);
    message.add_dihedral_deg(result.dihedral_rad[i] * 180 / std::numbers::pi);
  }
  message.set_count(static_cast<std::uint32_t>(message.labels_size()));
  message.set_threshold(min);
  return message.SerializeAsString();
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

std::string mesh_file(const crease::v1::Job& job, crease::MeshFormat format, const LabelledMesh& result) {
  const std::string fingerprint = crease::job_fingerprint(job.input().sha256(), job.input().format(), job.parameters());
  return crease::encode_mesh(
      result, format,
      crease::mesh_extras(fingerprint, job.parameters(), facts_of(job.input()), facts_of(job.result())));
}

}  // namespace

/// The right to make one file, waited for while another makes it.
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

std::shared_ptr<const OpenFile> ResultFiles::mesh(const crease::v1::Job& job, crease::MeshFormat format) {
  return kept(job, fmt::format("mesh.{}", crease::format_name(format)),
              [&](const LabelledMesh& result) { return mesh_file(job, format, result); });
}

std::shared_ptr<const OpenFile> ResultFiles::snapshot(const crease::v1::Job& job, crease::MeshFormat format) {
  const auto source = store_.file_path(job.id(), file::kSnapshot);
  if (!std::filesystem::exists(source)) throw Error("snapshot_unavailable", "the job has left no snapshot yet");
  return passing(source, [&](const LabelledMesh& result) { return mesh_file(job, format, result); });
}

std::shared_ptr<const OpenFile> ResultFiles::labels(const crease::v1::Job& job, LabelFormat format, double min) {
  const auto encode = [&](const LabelledMesh& result) {
    if (format == LabelFormat::kProtobuf) return encode_labels_protobuf(result, min);
    return format == LabelFormat::kCsv ? crease::encode_labels_csv(result, min)
                                       : crease::encode_labels_json(result, min);
  };
  if (min > 0) return passing(store_.file_path(job.id(), file::kResult), encode);
  const std::string_view extension = format == LabelFormat::kJson ? "json" : format == LabelFormat::kCsv ? "csv" : "pb";
  return kept(job, fmt::format("labels.{}", extension), encode);
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
    ReplacingFile target(path, "part");
    write_all(target.descriptor(), bytes);
    target.commit(true);
    if (auto file = open_file(path)) return file;
  } catch (const Error&) {
    if (store_.find(job.id())) throw;
  }
  throw Error("job_not_found", "the job was removed");
}

std::shared_ptr<const OpenFile> ResultFiles::passing(const std::filesystem::path& source, const Encode& encode) {
  const Encoding encoding(encoders_);
  const std::string bytes = encode(read_result(source));
  const auto path = store_.temporary_path();
  const Descriptor file(::open(path.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0600));
  if (!file.open()) throw Error("store_unavailable", "cannot keep a result");
  write_all(file.get(), bytes);
  auto opened = open_file(path);
  std::error_code ignored;
  std::filesystem::remove(path, ignored);
  return opened;
}

}  // namespace creased
