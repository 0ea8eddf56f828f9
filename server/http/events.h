#pragma once

#include <atomic>
#include <memory>

#include "server/http/call.h"

namespace creased {

/// GET /v1/jobs/{id}/events: server-sent events, a bounded number of streams at a time.
class EventStreams {
 public:
  EventStreams(JobWatcher& watcher, std::size_t max_streams) : watcher_(watcher), max_streams_(max_streams) {}

  /// Sends `progress` with the progress, then `succeeded`, `failed` or `cancelled` with the job; `id` is the version.
  void open(Call& call);
  std::size_t count() const { return *count_; }

 private:
  JobWatcher& watcher_;
  std::size_t max_streams_;
  std::shared_ptr<std::atomic<std::size_t>> count_ = std::make_shared<std::atomic<std::size_t>>(0);
};

}  // namespace creased
