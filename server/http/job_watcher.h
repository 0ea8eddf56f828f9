#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <unordered_map>

#include "server/store/store.h"

namespace creased {

/// Whether a job in this state changes no more.
bool is_terminal(const std::string& state);

/// A job as it stood at a version.
struct JobView {
  crease::v1::Job job;
  std::uint64_t version = 0;

  /// What `make` makes of this view, made once however many ask.
  template <typename Make>
  const std::string& event(const Make& make) const {
    std::call_once(made_, [&] { event_ = make(*this); });
    return event_;
  }

  JobView(crease::v1::Job its_job, std::uint64_t its_version) : job(std::move(its_job)), version(its_version) {}

 private:
  mutable std::once_flag made_;
  mutable std::string event_;
};

/// One thread that looks for changes in the store and hands every changed job, read once, to all who wait for it:
/// hundreds of event streams cost the store no more than one.
class JobWatcher {
 private:
  struct Channel;

 public:
  using Clock = std::chrono::steady_clock;

  /// `on_change` is told of every changed job.
  JobWatcher(Store& store, std::chrono::milliseconds poll, std::function<void(const crease::v1::Job&)> on_change);
  ~JobWatcher();

  /// A place from which one job is watched. Must not outlive the watcher.
  class Subscription {
   public:
    Subscription(JobWatcher& watcher, std::string id, std::shared_ptr<Channel> channel);
    ~Subscription();
    Subscription(const Subscription&) = delete;
    Subscription& operator=(const Subscription&) = delete;

    /// The job as soon as it is newer than `version`, at the latest at `deadline` as it is then. Null: it was removed.
    std::shared_ptr<const JobView> wait_newer(std::uint64_t version, Clock::time_point deadline);

   private:
    JobWatcher& watcher_;
    std::string id_;
    std::shared_ptr<Channel> channel_;
  };

  /// Null: no such job.
  std::unique_ptr<Subscription> subscribe(const std::string& id);

  /// Tells those who watch a job at once that it has changed or gone.
  void refresh(const std::string& id);

  /// Lets all waits return at once, from now on.
  void close();
  bool closed() const { return closed_; }

 private:
  void run();
  void look();
  std::shared_ptr<Channel> channel(const std::string& id);
  std::shared_ptr<const JobView> load(const std::string& id);
  void unsubscribe(const std::string& id);

  Store& store_;
  const std::chrono::milliseconds poll_;
  const std::function<void(const crease::v1::Job&)> on_change_;
  std::atomic<bool> closed_{false};
  std::uint64_t seen_ = 0;  // of the watching thread alone

  std::mutex mutex_;
  std::condition_variable stop_changed_;
  bool stop_ = false;
  std::unordered_map<std::string, std::shared_ptr<Channel>> channels_;
  std::thread thread_;
};

}  // namespace creased
