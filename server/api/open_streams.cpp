#include "server/api/open_streams.h"

#include <fmt/format.h>

#include "core/error.h"

namespace creased {
namespace code = crease::code;

OpenStreams::Slot::Slot(OpenStreams& open, std::string owner) : open_(open), owner_(std::move(owner)) {
  ++open_.all_;
  ++open_.by_owner_[owner_];
}

OpenStreams::Slot::~Slot() {
  const std::lock_guard lock(open_.mutex_);
  --open_.all_;
  const auto found = open_.by_owner_.find(owner_);
  if (--found->second == 0) open_.by_owner_.erase(found);
}

std::unique_ptr<OpenStreams::Slot> OpenStreams::take(const Caller& caller) {
  const std::size_t of_key = caller.limits.max_streams;
  const std::string owner = caller.owner();
  const std::lock_guard lock(mutex_);
  if (all_ >= most_) {
    throw crease::Error(code::kTooManyStreams,
                        fmt::format("{} event streams are open, the most that this server allows", all_));
  }
  const auto own = by_owner_.find(owner);
  if (of_key > 0 && own != by_owner_.end() && own->second >= of_key) {
    throw crease::Error(code::kKeyStreamsFull,
                        fmt::format("{} event streams are open, the most that this key may have", own->second));
  }
  return std::make_unique<Slot>(*this, owner);
}

std::size_t OpenStreams::count() const {
  const std::lock_guard lock(mutex_);
  return all_;
}

}  // namespace creased
