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
  Address address;     ///< of the client, behind any trusted proxies
  bool local = false;  ///< from this machine, not through a proxy
};

/// A caller and its limits.
struct Caller {
  std::shared_ptr<const Key> key;  ///< null when no key is needed or the given one is not valid
  Limits limits;

  /// Owner of the caller's jobs; empty on a service without keys.
  std::string owner() const { return key == nullptr ? std::string() : key->id; }
};

/// Identifies callers by their keys or addresses and counts their calls and jobs.
class Gatekeeper {
 public:
  struct Options {
    std::filesystem::path keys;  ///< empty for a service without keys
    Limits open;                 ///< for callers without a key; its limits on uploads and faces apply to all
    Limits key_defaults;         ///< for keys whose entries do not set them
  };

  /// \throw KeyFileError
  explicit Gatekeeper(Options options);

  bool keyed() const { return !options_.keys.empty(); }
  /// Reloads the keys. Keeps the previous ones when that fails. \throw KeyFileError
  void reload();

  /// Whether jobs of this owner have a key that is still valid. On a service without keys every owner has.
  bool knows(const std::string& owner) const;

  /// The caller that an Authorization header identifies. It has no key when the service has none or the given one is
  /// not valid.
  Caller identify(std::string_view authorization) const;

  /// The caller whose jobs this owner's are. It has no key when the service has none or the owner's is revoked.
  Caller caller_of(const std::string& owner) const;

  /// Counts a call. Returns zero when it is within the caller's rate, otherwise the time until the next call is
  /// allowed. Without a key, the rate is that of the address, and of IPv6 addresses of one site together eight times
  /// that.
  std::chrono::seconds count_call(const Caller& caller, const Source& source);
  /// Counts a submitted job in the same way.
  std::chrono::seconds count_job(const Caller& caller, const Source& source);

 private:
  const Options options_;
  mutable std::mutex mutex_;
  std::shared_ptr<const KeyRing> keys_;
  RateLimiter calls_, jobs_, sites_;
};

}  // namespace creased
