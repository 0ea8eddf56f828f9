#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>

#include "server/api/call.h"

namespace creased {

/// GET /v1/jobs/{id}/events: server-sent events. The number of open streams is limited.
class EventStreams {
 public:
  EventStreams(Store& store, JobWatcher& watcher, const Gatekeeper& gate, std::size_t max_streams)
      : store_(store), watcher_(watcher), gate_(gate), max_streams_(max_streams) {}

  /// Sends `progress` events, then `succeeded`, `failed` or `cancelled` with the job. The id of an event is the version
  /// of the job. A stream ends when its key is revoked.
  void open(Call& call);
  std::size_t count() const { return open_->count(); }

 private:
  /// Counts the open streams, in total and by owner.
  class Open {
   public:
    void add(const std::string& owner);
    void remove(const std::string& owner);
    std::size_t count() const;
    std::size_t count(const std::string& owner) const;

   private:
    mutable std::mutex mutex_;
    std::size_t all_ = 0;
    std::unordered_map<std::string, std::size_t> by_owner_;
  };
  class Slot;
  class Stream;

  std::unique_ptr<Slot> take_slot(const Caller& caller);

  Store& store_;
  JobWatcher& watcher_;
  const Gatekeeper& gate_;
  std::size_t max_streams_;
  std::shared_ptr<Open> open_ = std::make_shared<Open>();
};

}  // namespace creased
