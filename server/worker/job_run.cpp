#include "server/worker/job_run.h"

#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <thread>
#include <utility>
#include <vector>

#include "proto/error_table.h"
#include "server/base/failure.h"
#include "server/jobs/needs.h"
#include "server/worker/lease_keeper.h"

namespace creased {
namespace code = crease::code;
namespace v1 = crease::v1;
namespace {

using std::chrono::milliseconds;

constexpr std::string_view kPartial = "part";
constexpr milliseconds kLookEvery{20};
/// Time for a stopping computation to finish its sweep and write a checkpoint.
constexpr milliseconds kStopGrace{3'000};
/// An attempt may take this many times its limit of processor time, as the machine may have other work.
constexpr int kWallTimes = 4;
/// How long the end of an attempt is tried while the store fails, and how often.
constexpr std::chrono::minutes kSettleTime{10};
constexpr milliseconds kFirstSettlePause{50}, kLongestSettlePause{2'000};
/// Publishing progress takes at most this part of the time of a job, however slow the store is.
constexpr int kPartsOfPublications = 10;
/// What a computation may say of itself in one attempt.
constexpr std::size_t kMostNotes = 20, kLongestNote = 500, kLongestStage = 40;

double seconds_queued(const v1::Job& job) {
  using google::protobuf::util::TimeUtil;
  constexpr double kMsPerSecond = 1000;
  google::protobuf::Timestamp created, started;
  if (!TimeUtil::FromString(job.created_at(), &created) || !TimeUtil::FromString(job.started_at(), &started)) return 0;
  return static_cast<double>(TimeUtil::DurationToMilliseconds(started - created)) / kMsPerSecond;
}

std::string_view name_of(v1::RunFile kind) {
  switch (kind) {
    case v1::RUN_FILE_RESULT:
      return file::kResult;
    case v1::RUN_FILE_REPORT:
      return file::kReport;
    case v1::RUN_FILE_SNAPSHOT:
      return file::kSnapshot;
    case v1::RUN_FILE_CHECKPOINT:
      return file::kCheckpoint;
    default:
      throw crease::Error(code::kInternal, "the computing process named an unknown file");
  }
}

bool is_passing(v1::RunFile kind) { return kind == v1::RUN_FILE_SNAPSHOT || kind == v1::RUN_FILE_CHECKPOINT; }

Durability durability_of(v1::RunFile kind) {
  if (kind == v1::RUN_FILE_SNAPSHOT) return Durability::kNone;
  return kind == v1::RUN_FILE_RESULT ? Durability::kContent
                                     : Durability::kWhole;  // the commit of the report follows and syncs the folder
}

v1::ComputeLimits limits_of(const WorkerOptions& options, const v1::Job& job) {
  v1::ComputeLimits limits;
  const Needs needs = needs_of(job.input(), job.parameters());
  // A job that was accepted with more memory than this worker gives has as much as there is.
  const bool all = options.memory_bytes == 0 || needs.memory_bytes < options.memory_bytes;
  limits.set_memory_bytes(all ? needs.memory_bytes : options.memory_bytes);
  limits.set_cpu_seconds(options.cpu_seconds);
  limits.set_file_bytes(needs.file_bytes);
  limits.set_max_vertices(options.limits.max_vertices);
  limits.set_max_faces(options.limits.max_faces);
  return limits;
}

}  // namespace

JobRun::JobRun(Store& store, const WorkerOptions& options, Sandbox& sandbox, Claim claim, const std::atomic<bool>& stop)
    : store_(store),
      options_(options),
      sandbox_(sandbox),
      claim_(std::move(claim)),
      stop_(stop),
      suffix_(fmt::format("{}.{}", claim_.attempt, kPartial)),
      publications_(kPartsOfPublications, options.progress_every / 2) {}

void JobRun::run() {
  std::optional<LeaseKeeper> keeper;
  try {
    keeper.emplace(store_, claim_, options_.lease, taken_away_);
    work();
    end(given_up_ ? given_up_ : started_computing_ ? sandbox_.loss() : std::nullopt);
  } catch (const crease::Error& error) {
    if (!sandbox_.ended()) sandbox_.kill();
    if (!is_fault_of_store(error.code())) return end_refused(crease::to_problem(error));
    end_deferred(error);
  }
}

void JobRun::work() {
  auto job = store_.find(claim_.job_id);
  if (!job) {
    taken_away_ = true;
    return;
  }
  job_ = std::move(*job);
  spdlog::info("job {} running: attempt {} by {}", claim_.job_id, claim_.attempt, claim_.owner);
  remove_leftovers();
  publish_stage("checking");
  start();
  started_computing_ = true;
  follow();
  publish_latest();
}

void JobRun::start() {
  v1::ComputeTask task;
  *task.mutable_limits() = limits_of(options_, job_);
  v1::RunTask& run = *task.mutable_run();
  *run.mutable_job() = job_;
  run.set_queued_seconds(seconds_queued(job_));
  run.set_progress_every_ms(static_cast<std::uint32_t>(options_.progress_every.count()));
  run.set_snapshot_every_ms(static_cast<std::uint32_t>(options_.snapshot_every.count()));
  run.set_checkpoint_every_ms(static_cast<std::uint32_t>(options_.checkpoint_every.count()));
  std::vector<std::shared_ptr<const OpenFile>> files;
  const auto add = [&](std::string_view name) {
    auto file = store_.open(claim_.job_id, name);
    if (file == nullptr) return false;
    files.push_back(std::move(file));
    return true;
  };
  if (!add(file::kUpload)) throw crease::Error(code::kUploadDamaged, "the upload of the job has vanished");
  task.set_has_weights(add(file::kWeights));
  run.set_has_checkpoint(add(file::kCheckpoint));
  std::vector<int> numbers;
  for (const auto& file : files) numbers.push_back(file->descriptor.get());
  sandbox_.start(task, numbers);
  for (const auto kind : {v1::RUN_FILE_RESULT, v1::RUN_FILE_REPORT}) offer(kind);
}

/// Offers the files for snapshots and checkpoints, once. Short jobs end before they need them.
void JobRun::offer_passing_files() {
  if (passing_files_offered_) return;
  passing_files_offered_ = true;
  try {
    for (const auto kind : {v1::RUN_FILE_SNAPSHOT, v1::RUN_FILE_CHECKPOINT}) offer(kind);
  } catch (const crease::Error& error) {
    spdlog::warn("job {}: continues without checkpoints: {}", claim_.job_id, error.detail());
  }
}

void JobRun::follow() {
  while (!sandbox_.ended()) {
    if (const auto event = sandbox_.next_event(Clock::now() + kLookEvery)) handle(*event);
    if (Clock::now() >= next_look_) look();
  }
}

/// Checks whether the computation should stop or has exceeded its time.
void JobRun::look() {
  const auto now = Clock::now();
  next_look_ = now + kLookEvery;
  if (publications_.due(now)) publish_latest();
  if (now - started_ >= std::min(options_.snapshot_every, options_.checkpoint_every) / 2) offer_passing_files();
  if (!stop_by_ && (stop_ || !is_held())) {
    if (stop_) offer_passing_files();
    v1::RunOrder order;
    order.set_stop(true);
    sandbox_.order(order);
    stop_by_ = now + kStopGrace;
  }
  if (stop_by_ && now >= *stop_by_) return give_up({.what = "did not stop in time and was killed"});
  if (options_.cpu_seconds > 0 && now - started_ > std::chrono::seconds(kWallTimes * options_.cpu_seconds)) {
    give_up({.what = fmt::format("took longer than {} s", kWallTimes * options_.cpu_seconds),
             .code = code::kTimeLimitExceeded,
             .by_limit = true});
  }
}

void JobRun::give_up(Loss loss) {
  sandbox_.kill();
  given_up_ = std::move(loss);
}

void JobRun::handle(const v1::ComputeEvent& event) {
  switch (event.event_case()) {
    case v1::ComputeEvent::kProgress:
      return receive(event.progress());
    case v1::ComputeEvent::kComplete:
      return complete(event.complete());
    case v1::ComputeEvent::kEnd:
      end_ = event.end();
      return;
    case v1::ComputeEvent::kNote:
      return note(event.note());
    case v1::ComputeEvent::kRefused:
      refused_ = event.refused();
      return;
    default:
      throw crease::Error(code::kInternal, "the computing process sent an unexpected event");
  }
}

/// Gives the computation a new file of this kind.
void JobRun::offer(v1::RunFile kind) {
  auto& target = files_[kind];
  target.emplace(path(name_of(kind)), suffix_);
  v1::RunOrder order;
  order.set_file(kind);
  const int number = target->descriptor();
  sandbox_.order(order, {&number, 1});
}

void JobRun::complete(v1::RunFile kind) {
  auto& target = files_[kind];
  const std::string_view name = name_of(kind);
  if (!target) throw crease::Error(code::kInternal, fmt::format("{} was completed twice", name));
  try {
    if (!is_passing(kind)) {
      auto digest = digest_of(target->descriptor(), target->path());
      records_.push_back({std::string(name), digest.bytes, std::move(digest.sha256)});
    }
    target->commit(durability_of(kind));
    target.reset();
    if (kind == v1::RUN_FILE_CHECKPOINT) store_.note_checkpoint(claim_);
    if (kind == v1::RUN_FILE_SNAPSHOT) store_.note_snapshot(claim_);
    if (is_passing(kind)) offer(kind);
  } catch (const crease::Error& error) {
    if (!is_passing(kind)) throw;
    spdlog::warn("job {}: {}", claim_.job_id, error.detail());
  }
}

/// Keeps progress that comes faster than it is published: only the latest counts.
void JobRun::receive(const v1::Progress& progress) {
  if (progress.stage().size() > kLongestStage) {
    throw crease::Error(code::kInternal, "the computing process sent a stage that is too long");
  }
  latest_ = progress;
  if (publications_.due()) publish_latest();
}

void JobRun::publish_latest() {
  if (latest_) publish(*std::exchange(latest_, std::nullopt));
}

void JobRun::note(const std::string& text) {
  if (++notes_ > kMostNotes) return;
  spdlog::warn("job {}: {}{}", claim_.job_id, text.substr(0, kLongestNote),
               notes_ == kMostNotes ? " (its further notes are left out)" : "");
}

void JobRun::publish(const v1::Progress& progress) {
  *job_.mutable_progress() = progress;
  const auto started = Clock::now();
  try {
    store_.publish_progress(claim_, progress);
  } catch (const crease::Error& error) {
    spdlog::warn("job {}: cannot store the progress: {}", claim_.job_id, error.detail());
  }
  publications_.note(started);
}

void JobRun::publish_stage(std::string_view stage) {
  v1::Progress progress = job_.progress();
  progress.set_stage(std::string(stage));
  publish(progress);
}

bool JobRun::is_held() {
  if (taken_away_) return false;
  try {
    return store_.check(claim_) == Store::Hold::kHeld;
  } catch (const crease::Error& error) {
    spdlog::warn("job {}: the store is not available: {}", claim_.job_id, error.detail());
    return true;
  }
}

void JobRun::end(const std::optional<Loss>& loss) {
  if (!started_computing_) return log_end(false, "started");
  if (stop_by_ && (loss || refused_ || !end_ || end_->stopped())) return end_early();
  if (refused_) return end_refused(*refused_);
  if (loss) return end_lost(*loss);
  if (!end_ || files_[v1::RUN_FILE_RESULT] || files_[v1::RUN_FILE_REPORT]) {
    return end_lost({.what = "ended without a result"});
  }
  end_succeeded();
}

void JobRun::settle(std::string_view end, const std::function<bool()>& what) {
  files_.clear();
  const auto deadline = Clock::now() + kSettleTime;
  auto pause = kFirstSettlePause;
  for (;;) {
    try {
      return log_end(what(), end);
    } catch (const crease::Error& error) {
      if (!is_fault_of_store(error.code()) || stop_ || Clock::now() >= deadline) throw;
      spdlog::warn("job {}: attempt {} {}, but this cannot be stored yet: {}", claim_.job_id, claim_.attempt, end,
                   error.detail());
    }
    std::this_thread::sleep_for(pause);
    pause = std::min(pause * 2, kLongestSettlePause);
  }
}

void JobRun::end_early() {
  remove(file::kSnapshot);
  settle("queued again or cancelled", [&] {
    return store_.check(claim_) == Store::Hold::kCancelRequested ? store_.finish_cancelled(claim_)
                                                                 : store_.put_back(claim_);
  });
}

void JobRun::end_succeeded() {
  const std::vector<v1::Warning> warnings(end_->warnings().begin(), end_->warnings().end());
  settle("succeeded", [&] { return store_.succeed(claim_, end_->result(), warnings, records_); });
}

void JobRun::end_refused(const v1::Problem& problem) {
  const crease::Error error = crease::to_error(problem);
  if (is_limit_of_job(error.code())) {
    return end_lost({.what = error.detail(), .code = error.code(), .by_limit = true});
  }
  if (is_fault_of_store(error.code())) return end_deferred(error);
  const v1::Problem known = crease::to_problem(error);  // the computation may have named any title and status
  settle(fmt::format("failed ({}: {})", known.code(), known.detail()), [&] { return store_.fail(claim_, known); });
}

void JobRun::end_deferred(const crease::Error& reason) {
  remove(file::kSnapshot);
  settle("queued again: " + reason.detail(), [&] { return store_.defer(claim_, reason); });
}

void JobRun::end_lost(const Loss& loss) {
  remove(file::kSnapshot);
  settle("lost: " + loss.what, [&] { return store_.lose(claim_, loss); });
}

void JobRun::log_end(bool accepted, std::string_view end) const {
  if (accepted) {
    spdlog::info("job {} {}: attempt {} after {:.3f} s", claim_.job_id, end, claim_.attempt, stopwatch_.seconds());
  } else {
    spdlog::warn("job {} abandoned: attempt {} {} after {:.3f} s, but the job no longer belonged to this worker",
                 claim_.job_id, claim_.attempt, end, stopwatch_.seconds());
  }
}

void JobRun::remove_leftovers() const {
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(path(file::kResult).parent_path(), ignored)) {
    if (entry.path().extension() == fmt::format(".{}", kPartial)) std::filesystem::remove(entry.path(), ignored);
  }
}

void JobRun::remove(std::string_view name) const {
  std::error_code ignored;
  std::filesystem::remove(path(name), ignored);
}

}  // namespace creased
