#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/stopwatch.h"
#include "crease/v1/compute.pb.h"
#include "server/base/pace.h"
#include "server/store/store.h"
#include "server/worker/sandbox.h"
#include "server/worker/worker.h"

namespace creased {

/// One attempt of one job, from its claim to its end. Starts the confined process and stores what it computes.
class JobRun {
 public:
  JobRun(Store& store, const WorkerOptions& options, Sandbox& sandbox, Claim claim, const std::atomic<bool>& stop);

  /// Runs the attempt and ends its claim in the store, unless the job was taken away. While the store fails, the claim
  /// is kept and its end tried again, so that a sick disk costs no work. \throw Error store_unavailable, storage_full
  /// when the store did not come back in time, or the worker has to stop
  void run();

 private:
  using Clock = std::chrono::steady_clock;

  void work();
  void start();
  void follow();
  void look();
  void give_up(Loss loss);
  void handle(const crease::v1::ComputeEvent& event);
  void offer(crease::v1::RunFile file);
  void offer_passing_files();
  void complete(crease::v1::RunFile file);
  void receive(const crease::v1::Progress& progress);
  void note(const std::string& text);
  void publish(const crease::v1::Progress& progress);
  void publish_latest();
  void publish_stage(std::string_view stage);
  bool is_held();

  void end(const std::optional<Loss>& loss);
  void end_early();
  void end_succeeded();
  void end_refused(const crease::v1::Problem& problem);
  void end_deferred(const crease::Error& reason);
  /// Ends the claim: does `what`, again and again while the store fails.
  void settle(std::string_view end, const std::function<bool()>& what);
  void end_lost(const Loss& loss);
  void log_end(bool accepted, std::string_view end) const;

  std::filesystem::path path(std::string_view name) const { return store_.working_path(claim_, name); }
  void remove_leftovers() const;
  void remove(std::string_view name) const;

  Store& store_;
  const WorkerOptions& options_;
  Sandbox& sandbox_;
  const Claim claim_;
  const std::atomic<bool>& stop_;
  const std::string suffix_;  // of files being written; unique to this attempt
  crease::v1::Job job_;
  std::atomic<bool> taken_away_{false};
  std::map<crease::v1::RunFile, std::optional<ReplacingFile>> files_;
  const crease::Stopwatch stopwatch_;
  Clock::time_point started_ = Clock::now(), next_look_ = started_;
  bool passing_files_offered_ = false, started_computing_ = false;
  std::optional<crease::v1::Progress> latest_;  // not published yet
  Pace publications_;
  std::size_t notes_ = 0;
  std::vector<FileRecord> records_;           // of the complete files of the result
  std::optional<Clock::time_point> stop_by_;  // set when the computation was told to stop
  std::optional<Loss> given_up_;              // set when the computation was killed
  std::optional<crease::v1::RunEnd> end_;
  std::optional<crease::v1::Problem> refused_;
};

}  // namespace creased
