#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <string>
#include <string_view>

#include "core/job.h"
#include "crease/v1/job.pb.h"
#include "crease/v1/result.pb.h"
#include "server/store/store.h"
#include "server/worker/worker.h"

namespace creased {

/// One attempt of one job, from claim to end.
class JobRun {
 public:
  JobRun(Store& store, const WorkerOptions& options, Claim claim, const std::atomic<bool>& stop);

  /// Ends the claim in the store in one of its four ways, or leaves a job that was taken away.
  /// \throw Error store_unavailable when the store cannot be told; the lease then runs out
  void run();

 private:
  using Clock = std::chrono::steady_clock;

  void work();
  crease::CheckedInput check_upload();
  bool on_sweep(const crease::CheckedInput& input, const crease::SweepView& view);
  void publish(const crease::v1::Progress& progress);
  void publish_stage(std::string_view stage);
  void write_snapshot(const crease::CheckedInput& input, const crease::SweepView& view);
  void write_result(crease::LabelledMesh result);
  void write_report(const crease::JobOutput& output);

  bool is_held();
  void end_early();
  void end_failed(const crease::Error& error);
  void log_end(bool accepted, std::string_view end) const;

  std::filesystem::path path(std::string_view name) const { return store_.file_path(claim_.job_id, name); }
  void remove_leftovers() const;
  void remove_snapshot() const;

  Store& store_;
  const WorkerOptions& options_;
  const Claim claim_;
  const std::atomic<bool>& stop_;
  const std::string suffix_;  // of files that are being written: no other attempt writes the same
  crease::v1::Job job_;
  crease::v1::Timings timings_;
  std::vector<crease::v1::Warning> warnings_;
  crease::RunContext context_;
  Clock::time_point started_ = Clock::now();
  Clock::time_point next_check_, next_progress_, next_snapshot_;
};

}  // namespace creased
