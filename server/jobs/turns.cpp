#include "server/jobs/turns.h"

#include <algorithm>
#include <tuple>

namespace creased {
namespace {

constexpr std::size_t kMostIdleOwners = 1'000;  // whose last turn is remembered

}  // namespace

Turns::Ticket Turns::enter(const std::string& owner, std::chrono::milliseconds work, Clock::time_point now) {
  waiting_.push_back({++last_ticket_, owner, work >= large_, now + work});
  ++owners_[owner].waiting;
  return last_ticket_;
}

bool Turns::goes_before(const Work& one, const Work& other) const {
  const auto rank = [this](const Work& work) {
    const Owner& owner = owners_.at(work.owner);
    return std::tuple(owner.places, owner.served, work.counts_from, work.ticket);
  };
  return rank(one) < rank(other);
}

bool Turns::has_place(const Work& work) const { return !work.large || places_ < 2 || large_running_ + 1 < places_; }

std::optional<Turns::Ticket> Turns::next() {
  if (running_.size() >= places_) return std::nullopt;
  auto best = waiting_.end();
  for (auto work = waiting_.begin(); work != waiting_.end(); ++work) {
    if (has_place(*work) && (best == waiting_.end() || goes_before(*work, *best))) best = work;
  }
  if (best == waiting_.end()) return std::nullopt;
  Owner& owner = owners_[best->owner];
  --owner.waiting;
  ++owner.places;
  owner.served = ++turns_;
  if (best->large) ++large_running_;
  const Ticket ticket = best->ticket;
  running_.emplace(ticket, std::move(*best));
  waiting_.erase(best);
  return ticket;
}

void Turns::leave(Ticket ticket) {
  if (const auto running = running_.find(ticket); running != running_.end()) {
    if (running->second.large) --large_running_;
    const std::string owner = running->second.owner;
    --owners_[owner].places;
    running_.erase(running);
    return forget_if_idle(owner);
  }
  const auto waiting = std::ranges::find(waiting_, ticket, &Work::ticket);
  if (waiting == waiting_.end()) return;
  const std::string owner = waiting->owner;
  --owners_[owner].waiting;
  waiting_.erase(waiting);
  forget_if_idle(owner);
}

/// Keeps the last turns of owners without work as long as there are few.
void Turns::forget_if_idle(const std::string& owner) {
  const auto known = owners_.find(owner);
  if (owners_.size() > kMostIdleOwners && known->second.places == 0 && known->second.waiting == 0) owners_.erase(known);
}

}  // namespace creased
