#include "server/worker/job_run.h"

#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <new>
#include <utility>

#include "proto/convert.h"
#include "proto/error_table.h"
#include "proto/parameter_table.h"
#include "server/store/failure.h"
#include "server/worker/lease_keeper.h"
#include "server/worker/mapped_file.h"
#include "server/worker/message_file.h"

namespace creased {
namespace v1 = crease::v1;
namespace {

constexpr std::string_view kPartial = "part";
constexpr std::chrono::milliseconds kCheckEvery{5};
// Snapshots of a large mesh may not take more than this part of the time of smoothing.
constexpr int kLeastSmoothingPerSnapshot = 20;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double seconds_queued(const v1::Job& job) {
  using google::protobuf::util::TimeUtil;
  constexpr double kMsPerSecond = 1000;
  google::protobuf::Timestamp created, started;
  if (!TimeUtil::FromString(job.created_at(), &created) || !TimeUtil::FromString(job.started_at(), &started)) return 0;
  return static_cast<double>(TimeUtil::DurationToMilliseconds(started - created)) / kMsPerSecond;
}

}  // namespace

JobRun::JobRun(Store& store, const WorkerOptions& options, Claim claim, const std::atomic<bool>& stop)
    : store_(store),
      options_(options),
      claim_(std::move(claim)),
      stop_(stop),
      suffix_(fmt::format("{}.{}", claim_.attempt, kPartial)),
      next_snapshot_(started_ + options.snapshot_every) {}

void JobRun::run() {
  try {
    const LeaseKeeper keeper(store_, claim_, options_.lease, context_.cancel);
    work();
  } catch (const crease::Error& error) {
    end_failed(error);
  } catch (const std::bad_alloc&) {
    end_failed({code::kMemoryExhausted, "the job needs more memory than its worker may use"});
  } catch (const std::exception& error) {
    end_failed({code::kInternal, std::string("the job stopped unexpectedly: ") + error.what()});
  }
}

void JobRun::work() {
  auto job = store_.find(claim_.job_id);
  if (!job) return log_end(false, "started");
  job_ = std::move(*job);
  spdlog::info("job {} running: attempt {} by {}", claim_.job_id, claim_.attempt, claim_.owner);
  timings_.set_queued_seconds(seconds_queued(job_));
  remove_leftovers();
  publish_stage("checking");

  auto input = check_upload();
  for (const auto& warning : input.warnings) warnings_.push_back(crease::to_message(warning));
  context_.on_sweep = [&](const crease::SweepView& view) { return on_sweep(input, view); };
  crease::JobOutput output = crease::run_job(input, crease::to_options(job_.parameters()), context_);
  if (output.cancelled) return end_early();
  timings_.set_smooth_seconds(output.facts.seconds);
  input = {};

  publish_stage("encoding");
  write_result(std::move(output.result));
  write_report(output);
  log_end(store_.succeed(claim_, crease::to_message(output.facts), warnings_), "succeeded");
  remove_snapshot();
}

crease::CheckedInput JobRun::check_upload() {
  const auto start = Clock::now();
  const MappedFile upload(store_.upload_path(claim_.job_id));
  std::optional<MappedFile> weights;
  if (const auto file = path(file::kWeights); std::filesystem::exists(file)) weights.emplace(file);
  auto input = crease::check_input(upload.bytes(), crease::format_from_name(job_.input().format()), options_.limits,
                                   bytes_of(weights));
  if (crease::to_message(input).weights_sha256() != job_.input().weights_sha256()) {
    throw crease::Error(code::kInternal, "the weights of the job are not those that it was submitted with");
  }
  timings_.set_decode_seconds(seconds_since(start));
  return input;
}

bool JobRun::on_sweep(const crease::CheckedInput& input, const crease::SweepView& view) {
  if (stop_) return false;
  const auto now = Clock::now();
  if (now >= next_check_) {
    if (!is_held()) return false;
    next_check_ = now + kCheckEvery;
  }
  if (now >= next_progress_ || view.record.sweep == view.sweeps) {
    publish(crease::to_message(view));
    next_progress_ = now + options_.progress_every;
  }
  if (now >= next_snapshot_) {
    write_snapshot(input, view);
    const auto cost = Clock::now() - now;
    next_snapshot_ =
        Clock::now() + std::max<Clock::duration>(options_.snapshot_every, cost * kLeastSmoothingPerSnapshot);
  }
  return true;
}

void JobRun::publish(const v1::Progress& progress) {
  *job_.mutable_progress() = progress;
  try {
    store_.publish_progress(claim_, progress);
  } catch (const crease::Error& error) {
    spdlog::warn("job {}: progress could not be written: {}", claim_.job_id, error.detail());
  }
}

void JobRun::publish_stage(std::string_view stage) {
  v1::Progress progress = job_.progress();
  progress.set_stage(std::string(stage));
  publish(progress);
}

void JobRun::write_snapshot(const crease::CheckedInput& input, const crease::SweepView& view) {
  try {
    crease::LabelledMesh mesh{{view.positions(), input.mesh.triangles}, input.topology.edges, view.labels(), {}};
    mesh.dihedral_rad = crease::signed_dihedral_angles(input.mesh, input.topology, mesh.mesh.positions);
    write_message(path(file::kSnapshot), suffix_, crease::to_message(mesh), false);
  } catch (const crease::Error& error) {
    spdlog::warn("job {}: no snapshot: {}", claim_.job_id, error.detail());
  }
}

void JobRun::write_result(crease::LabelledMesh result) {
  const auto start = Clock::now();
  const v1::LabelledMesh message = crease::to_message(result);
  result = {};
  write_message(path(file::kResult), suffix_, message, true);
  timings_.set_encode_seconds(seconds_since(start));
}

void JobRun::write_report(const crease::JobOutput& output) {
  v1::Report report;
  report.set_id(claim_.job_id);
  report.set_version(CREASE_VERSION);
  *report.mutable_input() = job_.input();
  *report.mutable_parameters() = job_.parameters();
  *report.mutable_result() = crease::to_message(output.facts);
  *report.mutable_timings() = timings_;
  for (const auto& sweep : output.sweeps) *report.add_sweeps() = crease::to_message(sweep);
  *report.mutable_warnings() = {warnings_.begin(), warnings_.end()};
  write_message(path(file::kReport), suffix_, report, true);
}

bool JobRun::is_held() {
  try {
    return store_.check(claim_) == Store::Hold::kHeld;
  } catch (const crease::Error& error) {
    spdlog::warn("job {}: the store does not answer: {}", claim_.job_id, error.detail());
    return true;
  }
}

void JobRun::end_early() {
  switch (store_.check(claim_)) {
    case Store::Hold::kCancelRequested:
      log_end(store_.finish_cancelled(claim_), "cancelled");
      break;
    case Store::Hold::kHeld:
      log_end(store_.put_back(claim_), "put back");
      break;
    case Store::Hold::kLost:
      return log_end(false, "stopped");
  }
  remove_snapshot();
}

void JobRun::end_failed(const crease::Error& error) {
  log_end(store_.fail(claim_, crease::to_problem(error)), fmt::format("failed ({}: {})", error.code(), error.detail()));
  remove_snapshot();
}

void JobRun::log_end(bool accepted, std::string_view end) const {
  if (accepted) {
    spdlog::info("job {} {}: attempt {} after {:.3f} s", claim_.job_id, end, claim_.attempt, seconds_since(started_));
  } else {
    spdlog::warn("job {} abandoned: attempt {} {} after {:.3f} s, when it was no longer this worker's", claim_.job_id,
                 claim_.attempt, end, seconds_since(started_));
  }
}

void JobRun::remove_leftovers() const {
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(path(file::kResult).parent_path(), ignored)) {
    if (entry.path().extension() == fmt::format(".{}", kPartial)) std::filesystem::remove(entry.path(), ignored);
  }
}

void JobRun::remove_snapshot() const {
  std::error_code ignored;
  std::filesystem::remove(path(file::kSnapshot), ignored);
}

}  // namespace creased
