#include "server/access/rate_limiter.h"

#include <algorithm>

namespace creased {

RateLimiter::Bucket& RateLimiter::bucket_of(const std::string& who, const Rate& rate, Clock::time_point now) {
  const auto found = by_name_.find(who);
  if (found != by_name_.end()) {
    buckets_.splice(buckets_.begin(), buckets_, found->second);
    return buckets_.front();
  }
  if (buckets_.size() == max_buckets_) {
    by_name_.erase(buckets_.back().who);
    buckets_.pop_back();
  }
  buckets_.push_front({who, rate.burst, now});
  by_name_[who] = buckets_.begin();
  return buckets_.front();
}

std::chrono::duration<double> RateLimiter::take(const std::string& who, const Rate& rate, Clock::time_point now) {
  if (!rate.bounded()) return {};
  const std::lock_guard lock(mutex_);
  Bucket& bucket = bucket_of(who, rate, now);
  const std::chrono::duration<double> passed = std::max(now, bucket.seen) - bucket.seen;
  bucket.tokens = std::min(rate.burst, bucket.tokens + passed.count() * rate.per_second);
  bucket.seen = std::max(now, bucket.seen);
  if (bucket.tokens < 1) return std::chrono::duration<double>((1 - bucket.tokens) / rate.per_second);
  bucket.tokens -= 1;
  return {};
}

std::size_t RateLimiter::buckets() const {
  const std::lock_guard lock(mutex_);
  return buckets_.size();
}

}  // namespace creased
