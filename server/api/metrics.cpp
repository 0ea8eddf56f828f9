#include "server/api/metrics.h"

#include <prometheus/text_serializer.h>

#include "server/api/job_watcher.h"

namespace creased {
namespace {

const prometheus::Histogram::BucketBoundaries kSeconds = {0.001, 0.005, 0.025, 0.1, 0.5, 2.5, 10, 60};

template <typename Builder>
auto& family(prometheus::Registry& registry, Builder&& builder, const char* name, const char* help) {
  return builder().Name(name).Help(help).Register(registry);
}

}  // namespace

Metrics::Metrics()
    : requests_(family(registry_, prometheus::BuildCounter, "creased_http_requests_total", "Requests answered.")),
      durations_(family(registry_, prometheus::BuildHistogram, "creased_http_request_seconds",
                        "Time from the end of a request's head to the end of its answer.")),
      bytes_(family(registry_, prometheus::BuildCounter, "creased_http_bytes_total",
                    "Bytes of request bodies and answers.")),
      ended_(family(registry_, prometheus::BuildCounter, "creased_jobs_ended_total", "Jobs that ended, by state.")),
      jobs_(family(registry_, prometheus::BuildGauge, "creased_jobs", "Jobs that have not ended, by state.")),
      queue_age_(family(registry_, prometheus::BuildGauge, "creased_queue_age_seconds",
                        "How long the first of the queued jobs has waited.")
                     .Add({})),
      streams_(family(registry_, prometheus::BuildGauge, "creased_event_streams", "Open event streams.").Add({})),
      connections_(family(registry_, prometheus::BuildGauge, "creased_connections", "Open connections.").Add({})) {}

void Metrics::count(const ExchangeSummary& exchange) {
  const std::string route = exchange.route.empty() ? "none" : exchange.route;
  const std::string method = exchange.route.empty() ? "none" : exchange.method;
  requests_.Add({{"method", method}, {"route", route}, {"status", std::to_string(exchange.status)}}).Increment();
  durations_.Add({{"route", route}}, kSeconds).Observe(exchange.seconds);
  bytes_.Add({{"direction", "in"}}).Increment(static_cast<double>(exchange.bytes_in));
  bytes_.Add({{"direction", "out"}}).Increment(static_cast<double>(exchange.bytes_out));
}

void Metrics::count_state(const std::string& job_id, const std::string& state) {
  const std::lock_guard lock(mutex_);
  if (!is_terminal(state)) {
    state_of_[job_id] = state;
  } else if (state_of_.erase(job_id) > 0) {
    ended_.Add({{"state", state}}).Increment();
  }
}

void Metrics::forget(const std::string& job_id) {
  const std::lock_guard lock(mutex_);
  state_of_.erase(job_id);
}

std::string Metrics::text(const Gauges& gauges) {
  std::size_t running = 0;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, state] : state_of_) running += state == "running" ? 1 : 0;
  }
  jobs_.Add({{"state", "queued"}}).Set(static_cast<double>(gauges.queued));
  jobs_.Add({{"state", "running"}}).Set(static_cast<double>(running));
  queue_age_.Set(std::chrono::duration<double>(gauges.longest_wait).count());
  streams_.Set(static_cast<double>(gauges.streams));
  connections_.Set(static_cast<double>(gauges.connections));
  return prometheus::TextSerializer().Serialize(registry_.Collect());
}

}  // namespace creased
