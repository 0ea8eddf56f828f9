#include "server/api/events.h"

#include <fmt/format.h>

#include <charconv>

#include "proto/convert.h"

namespace creased {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kHeartbeat{10'000};
constexpr milliseconds kPeerCheck{500};  // how often to look for a client that has disconnected
constexpr std::string_view kRetry = "retry: 1000\n\n";

std::uint64_t last_event_id(std::string_view header) {
  std::uint64_t id = 0;
  const auto [stop, error] = std::from_chars(header.data(), header.data() + header.size(), id);
  return error == std::errc() && stop == header.data() + header.size() ? id : 0;
}

std::string event_of(const JobView& view, const std::string& base) {
  const bool ended = is_terminal(view.job.state());
  return fmt::format("id: {}\nevent: {}\ndata: {}\n\n", view.version, ended ? view.job.state() : "progress",
                     ended ? job_json(view.job, base) : crease::json_text(view.job.progress()));
}

}  // namespace

void EventStreams::Open::add(const std::string& owner) {
  const std::lock_guard lock(mutex_);
  ++all_;
  ++by_owner_[owner];
}

void EventStreams::Open::remove(const std::string& owner) {
  const std::lock_guard lock(mutex_);
  --all_;
  const auto found = by_owner_.find(owner);
  if (--found->second == 0) by_owner_.erase(found);
}

std::size_t EventStreams::Open::count() const {
  const std::lock_guard lock(mutex_);
  return all_;
}

std::size_t EventStreams::Open::count(const std::string& owner) const {
  const std::lock_guard lock(mutex_);
  const auto found = by_owner_.find(owner);
  return found == by_owner_.end() ? 0 : found->second;
}

/// Counts one stream while it exists.
class EventStreams::Slot {
 public:
  Slot(std::shared_ptr<Open> open, std::string owner) : open_(std::move(open)), owner_(std::move(owner)) {
    open_->add(owner_);
  }
  ~Slot() { open_->remove(owner_); }
  const std::string& owner() const { return owner_; }
  Slot(const Slot&) = delete;
  Slot& operator=(const Slot&) = delete;

 private:
  std::shared_ptr<Open> open_;
  std::string owner_;
};

/// One stream. The server calls next() until the stream ends.
class EventStreams::Stream {
 public:
  Stream(JobWatcher& watcher, const Gatekeeper& gate, std::unique_ptr<JobWatcher::Subscription> subscription,
         std::unique_ptr<Slot> slot, std::uint64_t version, const Exchange& exchange)
      : watcher_(watcher),
        gate_(gate),
        subscription_(std::move(subscription)),
        slot_(std::move(slot)),
        version_(version),
        base_(exchange.base),
        connection_(exchange.stream) {}

  /// Sends what is due. Returns false when the client has disconnected.
  bool next(httplib::DataSink& sink) {
    if (!greeted_) return greet(sink);
    const auto now = JobWatcher::Clock::now();
    const auto view = subscription_->wait_newer(version_, now + kPeerCheck);
    if (connection_.peer_gone()) return false;
    if (!gate_.knows(slot_->owner())) return end(sink, ": the key was revoked\n\n");
    if (view == nullptr) return end(sink, ": the job was removed\n\n");
    if (view->version > version_) return report(*view, sink);
    if (watcher_.closed()) return end(sink, ": the server is shutting down\nretry: 2000\n\n");
    return now - last_sent_ < kHeartbeat || send(sink, ": keep-alive\n\n");
  }

 private:
  bool greet(httplib::DataSink& sink) {
    greeted_ = true;
    return send(sink, kRetry);
  }

  bool report(const JobView& view, httplib::DataSink& sink) {
    version_ = view.version;
    const auto make = [this](const JobView& of) { return event_of(of, base_); };
    // The text that is kept is for those who have nothing before the paths.
    if (!send(sink, base_.empty() ? view.event(make) : make(view))) return false;
    if (is_terminal(view.job.state())) sink.done();
    return true;
  }

  bool end(httplib::DataSink& sink, std::string_view last_words) {
    if (!send(sink, last_words)) return false;
    sink.done();
    return true;
  }

  bool send(httplib::DataSink& sink, std::string_view text) {
    last_sent_ = JobWatcher::Clock::now();
    return sink.write(text.data(), text.size());
  }

  JobWatcher& watcher_;
  const Gatekeeper& gate_;
  std::unique_ptr<JobWatcher::Subscription> subscription_;
  std::unique_ptr<Slot> slot_;
  std::uint64_t version_;
  const std::string base_;
  GuardedStream& connection_;
  bool greeted_ = false;
  JobWatcher::Clock::time_point last_sent_;
};

/// Counts the stream before it checks the limit, so that two streams opened at once cannot both take the last place.
std::unique_ptr<EventStreams::Slot> EventStreams::take_slot(const Caller& caller) {
  const std::string owner = caller.owner();
  auto slot = std::make_unique<Slot>(open_, owner);
  if (open_->count() > max_streams_) {
    throw crease::Error("too_many_streams",
                        fmt::format("{} event streams are open, the most that this server allows", max_streams_));
  }
  const std::size_t own = caller.limits.max_streams;
  if (own > 0 && open_->count(owner) > own) {
    throw crease::Error("key_streams_full",
                        fmt::format("{} event streams are open, the most that this key may have", own));
  }
  return slot;
}

void EventStreams::open(Call& call) {
  if (watcher_.closed()) throw crease::Error("shutting_down", "the server is shutting down");
  find_job(store_, call);
  auto slot = take_slot(call.caller());
  auto subscription = watcher_.subscribe(call.id);
  if (subscription == nullptr) throw crease::Error("job_not_found", "no job '" + call.id + "'");
  const std::uint64_t version = last_event_id(call.exchange.head.header("Last-Event-ID"));
  const auto now = subscription->wait_newer(0, JobWatcher::Clock::now());
  if (now != nullptr && is_terminal(now->job.state()) && version >= now->version) {
    call.response.status = 204;  // tells an EventSource not to reconnect
    return;
  }
  call.response.set_header("X-Accel-Buffering", "no");
  auto stream =
      std::make_shared<Stream>(watcher_, gate_, std::move(subscription), std::move(slot), version, call.exchange);
  const auto provider = [stream](std::size_t, httplib::DataSink& sink) { return stream->next(sink); };
  if (call.exchange.head.version == "HTTP/1.1") {
    call.response.set_chunked_content_provider("text/event-stream", provider);
  } else {
    call.exchange.close = true;
    call.response.set_content_provider("text/event-stream", provider);
  }
}

}  // namespace creased
