#pragma once

#include <prometheus/counter.h>
#include <prometheus/family.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>

#include <chrono>
#include <mutex>
#include <string>
#include <unordered_map>

#include "server/transport/guarded_server.h"

namespace creased {

/// The metrics of GET /metrics.
class Metrics {
 public:
  Metrics();

  void count(const ExchangeSummary& exchange);
  /// Counts a job that is in this state, and may have been in another.
  void count_state(const std::string& job_id, const std::string& state);
  void forget(const std::string& job_id);

  /// What is measured when somebody asks.
  struct Gauges {
    std::size_t queued = 0;
    std::chrono::milliseconds longest_wait{0};
    std::size_t streams = 0, connections = 0;
  };
  /// The metrics in Prometheus text format 0.0.4.
  std::string text(const Gauges& gauges);

 private:
  prometheus::Registry registry_;
  prometheus::Family<prometheus::Counter>& requests_;
  prometheus::Family<prometheus::Histogram>& durations_;
  prometheus::Family<prometheus::Counter>& bytes_;
  prometheus::Family<prometheus::Counter>& ended_;
  prometheus::Family<prometheus::Gauge>& jobs_;
  prometheus::Gauge& queue_age_;
  prometheus::Gauge& streams_;
  prometheus::Gauge& connections_;

  std::mutex mutex_;
  std::unordered_map<std::string, std::string> state_of_;  // of jobs that have not ended
};

}  // namespace creased
