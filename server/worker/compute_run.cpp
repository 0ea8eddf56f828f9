#include "server/worker/compute_run.h"

#include <fmt/format.h>
#include <google/protobuf/io/zero_copy_stream_impl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/state_archive.h"
#include "core/base/stopwatch.h"
#include "core/job.h"
#include "crease/v1/result.pb.h"
#include "proto/assembly.h"
#include "proto/convert.h"
#include "proto/parameter_table.h"
#include "server/base/failure.h"
#include "server/worker/channel.h"
#include "server/worker/checkpoint_file.h"
#include "server/worker/mapped_file.h"

namespace creased {
namespace code = crease::code;
namespace v1 = crease::v1;
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

// Smoothing gets at least this many times the time that writing a snapshot or checkpoint takes.
constexpr int kLeastSmoothingPerFile = 20;

/// Tells when something that is done periodically is due.
class Timer {
 public:
  explicit Timer(std::uint32_t every_ms) : every_(every_ms), next_(Clock::now() + every_) {}

  bool due() const { return Clock::now() >= next_; }
  template <class Work>
  void run(const Work& work) {
    const auto start = Clock::now();
    work();
    const auto end = Clock::now();
    next_ = end + std::max<Clock::duration>(every_, (end - start) * kLeastSmoothingPerFile);
  }

 private:
  Clock::duration every_;
  Clock::time_point next_;
};

void write_message(int file, const google::protobuf::MessageLite& message) {
  constexpr int kBlockBytes = 1 << 20;
  google::protobuf::io::FileOutputStream stream(file, kBlockBytes);
  if (!message.SerializeToZeroCopyStream(&stream) || !stream.Flush()) throw write_failure(stream.GetErrno());
}

class JobComputation {
 public:
  JobComputation(const v1::RunTask& task, const TaskFiles& files)
      : task_(task),
        files_(files),
        progress_(task.progress_every_ms()),
        snapshot_(task.snapshot_every_ms()),
        checkpoint_(task.checkpoint_every_ms()) {}

  void run() {
    const crease::CheckedInput input = check_upload();
    v1::Progress checked = task_.job().progress();
    checked.set_stage("smoothing");
    send_progress(checked);
    crease::RunContext context;
    context.on_sweep = [&](const crease::SweepView& view) { return on_sweep(input, view); };
    crease::JobOutput output = smooth(input, context);
    if (output.cancelled) return send_stopped();
    timings_.set_smooth_seconds(output.facts.seconds);
    v1::Progress encoding = last_progress_;
    encoding.set_stage("encoding");
    send_progress(encoding);
    for (const auto& warning : output.warnings) warnings_.push_back(crease::to_message(warning));
    write_result(std::move(output.result), input.mesh.positions);
    write_report(output);
    send_end(output.facts);
  }

 private:
  crease::CheckedInput check_upload() {
    const crease::Stopwatch stopwatch;
    const MappedFile upload(files_.upload);
    if (const std::string& accepted = task_.job().input().sha256();
        !accepted.empty() && crease::sha256_hex(upload.bytes()) != accepted) {
      throw crease::Error(code::kUploadDamaged, "the upload is not the one that was accepted: its SHA-256 differs");
    }
    std::optional<MappedFile> weights;
    if (files_.weights >= 0) weights.emplace(files_.weights);
    auto input = crease::check_upload({.bytes = upload.bytes(),
                                       .format = task_.job().input().format(),
                                       .name = task_.job().input().name(),
                                       .weights = bytes_of(weights),
                                       .limits = files_.limits,
                                       .threads = crease::to_options(task_.job().parameters()).threads});
    if (crease::to_message(input).weights_sha256() != task_.job().input().weights_sha256()) {
      throw crease::Error(code::kUploadDamaged, "the weights differ from those that the job was submitted with");
    }
    for (const auto& warning : input.warnings) warnings_.push_back(crease::to_message(warning));
    timings_.set_decode_seconds(stopwatch.seconds());
    return input;
  }

  /// Smooths from the checkpoint if there is a valid one, otherwise from the start.
  crease::JobOutput smooth(const crease::CheckedInput& input, crease::RunContext& context) {
    const crease::SmoothOptions options = crease::to_options(task_.job().parameters());
    if (files_.checkpoint >= 0) {
      try {
        const MappedFile file(files_.checkpoint);
        context.checkpoint = open_checkpoint(file.bytes());
        return crease::run_job(input, options, context);
      } catch (const crease::CheckpointError& error) {
        send_note(fmt::format("{}; the job starts from the beginning", error.what()));
        context.checkpoint = {};
      }
    }
    return crease::run_job(input, options, context);
  }

  bool on_sweep(const crease::CheckedInput& input, const crease::SweepView& view) {
    take_orders();
    if (stop_) {
      if (view.checkpoint) write_checkpoint(view);
      return false;
    }
    if (progress_.due() || view.record.sweep == view.sweeps) {
      progress_.run([&] { send_progress(crease::to_message(view)); });
    }
    if (snapshot_.due()) snapshot_.run([&] { write_snapshot(input, view); });
    if (view.checkpoint && checkpoint_.due()) checkpoint_.run([&] { write_checkpoint(view); });
    return true;
  }

  void take_orders() {
    while (take_order(Clock::now()) == Receipt::kMessage) {
    }
  }

  Receipt take_order(std::optional<Clock::time_point> deadline) {
    v1::RunOrder order;
    std::vector<Descriptor> received;
    const Receipt receipt = receive_message(files_.channel, order, deadline, &received);
    if (receipt == Receipt::kEnded) ::_exit(0);  // the worker has gone, so the result is not needed
    if (receipt != Receipt::kMessage) return receipt;
    stop_ = stop_ || order.stop();
    if (!received.empty()) outputs_[order.file()] = std::move(received.front());
    return receipt;
  }

  /// The descriptor to write the file to. Waits for the worker to send it.
  Descriptor output(v1::RunFile file) {
    while (!outputs_[file].open()) take_order(std::nullopt);
    return std::exchange(outputs_[file], Descriptor());
  }

  void send(const v1::ComputeEvent& event) {
    if (!send_message(files_.channel, event)) ::_exit(0);
  }

  void send_progress(const v1::Progress& progress) {
    last_progress_ = progress;
    v1::ComputeEvent event;
    *event.mutable_progress() = progress;
    send(event);
  }

  void send_complete(v1::RunFile file) {
    v1::ComputeEvent event;
    event.set_complete(file);
    send(event);
  }

  void send_note(const std::string& text) {
    v1::ComputeEvent event;
    event.set_note(text);
    send(event);
  }

  void send_stopped() {
    v1::ComputeEvent event;
    event.mutable_end()->set_stopped(true);
    send(event);
  }

  void send_end(const crease::ResultFacts& facts) {
    v1::ComputeEvent event;
    *event.mutable_end()->mutable_result() = crease::to_message(facts);
    *event.mutable_end()->mutable_warnings() = {warnings_.begin(), warnings_.end()};
    send(event);
  }

  // Failing to write a snapshot or checkpoint does not fail the job: at worst, another attempt has more to compute.
  template <class Write>
  void write_passing(v1::RunFile file, const Write& write) {
    take_orders();
    if (!outputs_[file].open()) return;  // the worker has not yet taken the previous one
    try {
      const Descriptor target = output(file);
      write(target.get());
      send_complete(file);
    } catch (const crease::Error& error) {
      send_note(error.detail());
    }
  }

  void write_snapshot(const crease::CheckedInput& input, const crease::SweepView& view) {
    write_passing(v1::RUN_FILE_SNAPSHOT, [&](int file) {
      crease::LabelledMesh mesh{{view.positions(), input.mesh.triangles}, input.topology.edges, view.labels(), {}};
      mesh.dihedral_rad = view.dihedral_rad();
      write_message(file, crease::to_message(mesh));
    });
  }

  void write_checkpoint(const crease::SweepView& view) {
    write_passing(v1::RUN_FILE_CHECKPOINT, [&](int file) {
      const std::string state = view.checkpoint();
      if (!write_all(file, checkpoint_head(state)) || !write_all(file, state)) throw write_failure(errno);
    });
  }

  void write_result(crease::LabelledMesh result, const std::vector<crease::Vec3>& measured) {
    const crease::Stopwatch stopwatch;
    v1::LabelledMesh message = crease::to_message(result);
    message.mutable_measured()->Reserve(static_cast<int>(3 * measured.size()));
    for (const crease::Vec3& position : measured) {
      for (const double coordinate : position) message.add_measured(coordinate);
    }
    result = {};
    write_message(output(v1::RUN_FILE_RESULT).get(), message);
    send_complete(v1::RUN_FILE_RESULT);
    timings_.set_encode_seconds(stopwatch.seconds());
  }

  void write_report(const crease::JobOutput& output_of_job) {
    v1::Job job = task_.job();
    for (const auto& warning : warnings_) crease::add_once(warning, *job.mutable_warnings());
    timings_.set_queued_seconds(task_.queued_seconds());
    const v1::Report report = crease::make_report(job, output_of_job, timings_);
    write_message(output(v1::RUN_FILE_REPORT).get(), report);
    send_complete(v1::RUN_FILE_REPORT);
  }

  const v1::RunTask& task_;
  const TaskFiles& files_;
  std::map<v1::RunFile, Descriptor> outputs_;
  Timer progress_, snapshot_, checkpoint_;
  bool stop_ = false;
  v1::Progress last_progress_;
  v1::Timings timings_;
  std::vector<v1::Warning> warnings_;
};

}  // namespace

crease::Error write_failure(int number) {
  // The limit on files is that of this job, so it is not the store's fault.
  if (number == EFBIG) return {code::kFileLimitExceeded, "needed a file larger than its limit"};
  errno = number;
  return file_failure("write", "a file of the job");
}

void run(const v1::RunTask& task, const TaskFiles& files) { JobComputation(task, files).run(); }

}  // namespace creased
