#include "server/api/job_watcher.h"

#include <spdlog/spdlog.h>

namespace creased {
namespace {

/// Looks for jobs that were removed take at most this part of the time, and come at most so often.
constexpr int kPartsOfLooks = 20;
constexpr std::chrono::seconds kBetweenLooks{1};

}  // namespace

struct JobWatcher::Channel {
  std::mutex mutex;
  std::condition_variable changed;
  std::shared_ptr<const JobView> latest;
  bool removed = false;
  std::size_t subscribers = 0;  // guarded by the watcher's mutex

  void publish(std::shared_ptr<const JobView> view) {
    const std::lock_guard lock(mutex);
    removed = view == nullptr;
    // An older load may finish after a newer one.
    if (view != nullptr && (latest == nullptr || view->version >= latest->version)) latest = std::move(view);
    changed.notify_all();
  }
};

JobWatcher::JobWatcher(Store& store, std::chrono::milliseconds poll, Reports reports)
    : store_(store),
      poll_(poll),
      reports_(std::move(reports)),
      seen_(store.last_version()),
      looks_for_removed_(kPartsOfLooks, kBetweenLooks),
      thread_([this] { run(); }) {}

JobWatcher::~JobWatcher() {
  close();
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  stop_changed_.notify_all();
  thread_.join();
}

void JobWatcher::run() {
  std::string fault;  // that was logged
  std::unique_lock lock(mutex_);
  while (!stop_changed_.wait_for(lock, poll_, [this] { return stop_; })) {
    lock.unlock();
    try {
      look();
      fault.clear();
    } catch (const std::exception& error) {
      if (fault != error.what()) spdlog::warn("cannot poll the store for changed jobs: {}", error.what());
      fault = error.what();
    }
    lock.lock();
  }
}

void JobWatcher::look() {
  const std::uint64_t last = store_.last_version();
  if (last != seen_) follow(last);
  if (may_be_removed_ && looks_for_removed_.due()) find_removed();
}

void JobWatcher::follow(std::uint64_t last) {
  const std::uint64_t before = seen_;
  const auto changes = store_.changes_since(seen_);
  for (const auto& change : changes) {
    seen_ = std::max(seen_, change.version);
    if (is_terminal(change.state)) {
      unended_.erase(change.job_id);
    } else {
      unended_.insert(change.job_id);
    }
    reports_.changed(change);
    refresh(change.job_id);
  }
  seen_ = std::max(seen_, last);
  // A version that no job has is that of a removal, or of an earlier change of a job that has changed again.
  if (seen_ - before > changes.size()) may_be_removed_ = true;
}

void JobWatcher::find_removed() {
  const auto started = Clock::now();
  std::unordered_set<std::string> known = unended_;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, watched] : channels_) known.insert(id);
  }
  for (const std::string& id : store_.missing({known.begin(), known.end()})) {
    unended_.erase(id);
    reports_.removed(id);
    refresh(id);
  }
  may_be_removed_ = false;
  looks_for_removed_.note(started);
}

std::shared_ptr<const JobView> JobWatcher::load(const std::string& id) {
  // Read the version first: a change in between then counts as newer than the job that was read.
  const std::uint64_t version = store_.version_of(id);
  auto job = store_.find(id);
  if (!job) return nullptr;
  return std::make_shared<const JobView>(std::move(*job), version);
}

std::shared_ptr<JobWatcher::Channel> JobWatcher::channel(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const auto found = channels_.find(id);
  return found == channels_.end() ? nullptr : found->second;
}

std::unique_ptr<JobWatcher::Subscription> JobWatcher::subscribe(const std::string& id) {
  std::shared_ptr<Channel> watched;
  {
    const std::lock_guard lock(mutex_);
    auto& entry = channels_[id];
    if (entry == nullptr) entry = std::make_shared<Channel>();
    ++entry->subscribers;
    watched = entry;
  }
  auto subscription = std::make_unique<Subscription>(*this, id, watched);
  bool known = false;
  {
    const std::lock_guard lock(watched->mutex);
    known = watched->latest != nullptr && !watched->removed;
  }
  if (known) return subscription;
  auto view = load(id);
  if (view == nullptr) return nullptr;
  watched->publish(std::move(view));
  return subscription;
}

void JobWatcher::unsubscribe(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const auto found = channels_.find(id);
  if (found != channels_.end() && --found->second->subscribers == 0) channels_.erase(found);
}

void JobWatcher::refresh(const std::string& id) {
  if (const auto watched = channel(id)) watched->publish(load(id));
}

void JobWatcher::close() {
  closed_ = true;
  std::vector<std::shared_ptr<Channel>> all;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, watched] : channels_) all.push_back(watched);
  }
  for (const auto& watched : all) {
    const std::lock_guard lock(watched->mutex);
    watched->changed.notify_all();
  }
}

JobWatcher::Subscription::Subscription(JobWatcher& watcher, std::string id, std::shared_ptr<Channel> channel)
    : watcher_(watcher), id_(std::move(id)), channel_(std::move(channel)) {}

JobWatcher::Subscription::~Subscription() { watcher_.unsubscribe(id_); }

std::shared_ptr<const JobView> JobWatcher::Subscription::wait_newer(std::uint64_t version, Clock::time_point deadline) {
  std::unique_lock lock(channel_->mutex);
  channel_->changed.wait_until(lock, deadline, [&] {
    return watcher_.closed() || channel_->removed ||
           (channel_->latest != nullptr && channel_->latest->version > version);
  });
  return channel_->removed ? nullptr : channel_->latest;
}

}  // namespace creased
