#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>

#include "server/access/gatekeeper.h"

namespace creased {

/// Counts the open event streams, in total and by owner, and bounds them.
class OpenStreams {
 public:
  explicit OpenStreams(std::size_t most) : most_(most) {}

  /// One open stream. It must not outlive the count.
  class Slot {
   public:
    Slot(OpenStreams& open, std::string owner);
    ~Slot();
    Slot(const Slot&) = delete;
    Slot& operator=(const Slot&) = delete;
    const std::string& owner() const { return owner_; }

   private:
    OpenStreams& open_;
    std::string owner_;
  };

  /// \throw crease::Error too_many_streams, key_streams_full
  std::unique_ptr<Slot> take(const Caller& caller);
  std::size_t count() const;

 private:
  const std::size_t most_;
  mutable std::mutex mutex_;
  std::size_t all_ = 0;
  std::unordered_map<std::string, std::size_t> by_owner_;
};

}  // namespace creased
