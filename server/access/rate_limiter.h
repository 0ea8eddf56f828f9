#pragma once

#include <chrono>
#include <list>
#include <mutex>
#include <string>
#include <unordered_map>

namespace creased {

/// A long-term rate per second, and a burst that may come at once.
struct Rate {
  double per_second = 0;  ///< 0 for no limit
  double burst = 1;

  bool bounded() const { return per_second > 0; }
};

/// A token bucket for every caller. Keeps only the most recently used buckets, so that its memory is bounded.
class RateLimiter {
 public:
  using Clock = std::chrono::steady_clock;

  static constexpr std::size_t kMaxBuckets = 65'536;

  explicit RateLimiter(std::size_t max_buckets = kMaxBuckets) : max_buckets_(max_buckets) {}

  /// Takes a token from the bucket of `who`. Returns zero on success, otherwise the time until the next token.
  std::chrono::duration<double> take(const std::string& who, const Rate& rate, Clock::time_point now = Clock::now());

  std::size_t buckets() const;

 private:
  struct Bucket {
    std::string who;
    double tokens;
    Clock::time_point seen;
  };

  Bucket& bucket_of(const std::string& who, const Rate& rate, Clock::time_point now);

  const std::size_t max_buckets_;
  mutable std::mutex mutex_;
  std::list<Bucket> buckets_;  // most recently used first
  std::unordered_map<std::string, std::list<Bucket>::iterator> by_name_;
};

}  // namespace creased
