#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <unordered_map>
#include <unordered_set>

#include "server/base/pace.h"
#include "server/jobs/state.h"
#include "server/store/store.h"

namespace creased {

/// A job at one version.
struct JobView {
  crease::v1::Job job;
  std::uint64_t version = 0;

  /// The text that `make` makes of this view. It is made once, however many threads ask for it.
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

/// A thread that polls the store for changes. It reads each changed job that somebody waits for once and passes it to
/// all who do, so hundreds of event streams cost the store no more than one.
class JobWatcher {
 private:
  struct Channel;

 public:
  using Clock = std::chrono::steady_clock;

  /// What is called from the thread, with every change and with the id of every job that was removed before its end, by
  /// whatever server.
  struct Reports {
    std::function<void(const JobChange&)> changed;
    std::function<void(const std::string&)> removed;
  };
  JobWatcher(Store& store, std::chrono::milliseconds poll, Reports reports);
  ~JobWatcher();

  /// Watches one job. Must not outlive the watcher.
  class Subscription {
   public:
    Subscription(JobWatcher& watcher, std::string id, std::shared_ptr<Channel> channel);
    ~Subscription();
    Subscription(const Subscription&) = delete;
    Subscription& operator=(const Subscription&) = delete;

    /// Waits until the job is newer than `version` or `deadline` has passed, and returns it as it is then; null when it
    /// was removed.
    std::shared_ptr<const JobView> wait_newer(std::uint64_t version, Clock::time_point deadline);

   private:
    JobWatcher& watcher_;
    std::string id_;
    std::shared_ptr<Channel> channel_;
  };

  /// Returns null when there is no such job.
  std::unique_ptr<Subscription> subscribe(const std::string& id);

  /// Notifies the subscribers of a job at once that it has changed or was removed.
  void refresh(const std::string& id);

  /// Makes all waits return at once, those under way and those to come.
  void close();
  bool closed() const { return closed_; }

 private:
  void run();
  void look();
  void follow(std::uint64_t last);
  void find_removed();
  std::shared_ptr<Channel> channel(const std::string& id);
  std::shared_ptr<const JobView> load(const std::string& id);
  void unsubscribe(const std::string& id);

  Store& store_;
  const std::chrono::milliseconds poll_;
  const Reports reports_;
  std::atomic<bool> closed_{false};
  // Used by the watching thread only.
  std::uint64_t seen_ = 0;
  std::unordered_set<std::string> unended_;
  bool may_be_removed_ = false;
  Pace looks_for_removed_;

  std::mutex mutex_;
  std::condition_variable stop_changed_;
  bool stop_ = false;
  std::unordered_map<std::string, std::shared_ptr<Channel>> channels_;
  std::thread thread_;
};

}  // namespace creased
