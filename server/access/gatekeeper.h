#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "server/access/address.h"
#include "server/access/key.h"
#include "server/access/rate_limiter.h"

namespace creased {

/// Where a request comes from.
struct Source {
  Address address;     ///< of the client, over trusted proxies
  bool local = false;  ///< from this machine and through no proxy
};

/// Who calls, and within which limits.
struct Caller {
  std::shared_ptr<const Key> key;  ///< null: none was needed, or none was right
  Limits limits;

  /// Of the jobs of this caller; empty when the service is open.
  std::string owner() const { return key == nullptr ? std::string() : key->id; }
};

/// Tells callers apart, by keys or by addresses, and counts what they do.
class Gatekeeper {
 public:
  struct Options {
    std::filesystem::path keys;  ///< empty: the service is open to all who reach it
    Limits open;                 ///< of callers without a key; its bounds on uploads and faces hold for all
    Limits key_defaults;         ///< of keys that do not say
  };

  /// \throw KeyFileError
  explicit Gatekeeper(Options options);

  bool keyed() const { return !options_.keys.empty(); }
  /// Reads the keys again; those of before stay when that fails. \throw KeyFileError
  void reload();

  /// The caller that an Authorization header speaks for; without a key where the service has none, or it is wrong.
  Caller identify(std::string_view authorization) const;

  /// Counts a call. Zero: it is within the caller's rate; otherwise how long until the next one is.
  std::chrono::seconds count_call(const Caller& caller, const Source& source);
  /// Likewise a job that is submitted.
  std::chrono::seconds count_job(const Caller& caller, const Source& source);

 private:
  const Options options_;
  mutable std::mutex mutex_;
  std::shared_ptr<const KeyRing> keys_;
  RateLimiter calls_, jobs_;
};

}  // namespace creased
