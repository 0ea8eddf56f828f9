#include "server/api/events.h"

#include <fmt/format.h>

#include <charconv>

#include "proto/convert.h"
#include "server/api/jobs.h"

namespace creased {
namespace code = crease::code;
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

/// One stream. The server calls next() until the stream ends.
class Stream {
 public:
  Stream(JobWatcher& watcher, const Gatekeeper& gate, std::unique_ptr<JobWatcher::Subscription> subscription,
         std::unique_ptr<OpenStreams::Slot> slot, std::uint64_t version, const Exchange& exchange)
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
  std::unique_ptr<OpenStreams::Slot> slot_;
  std::uint64_t version_;
  const std::string base_;
  GuardedStream& connection_;
  bool greeted_ = false;
  JobWatcher::Clock::time_point last_sent_;
};

/// Counts the stream before it checks the limit, so that two streams opened at once cannot both take the last place.
void watch_job(Services& services, Call& call) {
  if (services.watcher.closed()) throw crease::Error(code::kShuttingDown, "the server is shutting down");
  find_job(services.store, call);
  auto slot = services.streams.take(call.caller());
  auto subscription = services.watcher.subscribe(call.id);
  if (subscription == nullptr) throw crease::Error(code::kJobNotFound, "no job '" + call.id + "'");
  const std::uint64_t version = last_event_id(call.exchange.head.header("Last-Event-ID"));
  const auto now = subscription->wait_newer(0, JobWatcher::Clock::now());
  if (now != nullptr && is_terminal(now->job.state()) && version >= now->version) {
    call.response.status = 204;  // tells an EventSource not to reconnect
    return;
  }
  call.response.set_header("X-Accel-Buffering", "no");
  auto stream = std::make_shared<Stream>(services.watcher, services.gate, std::move(subscription), std::move(slot),
                                         version, call.exchange);
  const auto provider = [stream](std::size_t, httplib::DataSink& sink) { return stream->next(sink); };
  if (call.exchange.head.version == "HTTP/1.1") {
    call.response.set_chunked_content_provider("text/event-stream", provider);
  } else {
    call.exchange.close = true;
    call.response.set_content_provider("text/event-stream", provider);
  }
}

}  // namespace

std::vector<Route> event_routes() {
  return {{"GET",
           "/v1/jobs/{id}/events",
           "watch_job",
           "Follow a job as server-sent events: progress, then succeeded, failed or cancelled",
           {},
           {{200, "The events.", {"text/event-stream"}, ""}, {204, "There are no events after Last-Event-ID.", {}, ""}},
           {code::kJobNotFound, code::kKeyStreamsFull, code::kTooManyStreams, code::kShuttingDown},
           watch_job}};
}

}  // namespace creased
