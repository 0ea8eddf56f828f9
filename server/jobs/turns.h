#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace creased {

/// Whose turn it is among callers that wait for one of a few places: the order of inspections and encodings. It is the
/// order of the queue of jobs, too. Next is the owner with the fewest places, among these the one that was served
/// longest ago. Of its work, what came first is next, where work counts as coming later by the time that it will take.
/// So small work passes large, and none waits for ever. Large work leaves one place free for small work.
class Turns {
 public:
  using Ticket = std::uint64_t;
  using Clock = std::chrono::steady_clock;

  /// Work that takes at least `large` is large. A single place is for all.
  Turns(std::size_t places, std::chrono::milliseconds large) : places_(places), large_(large) {}

  Ticket enter(const std::string& owner, std::chrono::milliseconds work, Clock::time_point now = Clock::now());
  /// Gives the next turn, if a place is free for anyone who waits.
  std::optional<Ticket> next();
  /// Ends the waiting or the turn of a ticket.
  void leave(Ticket ticket);
  std::size_t waiting() const { return waiting_.size(); }
  /// The number of owners that are remembered.
  std::size_t owners() const { return owners_.size(); }

 private:
  struct Work {
    Ticket ticket;
    std::string owner;
    bool large;
    Clock::time_point counts_from;
  };
  struct Owner {
    std::size_t places = 0, waiting = 0;
    std::uint64_t served = 0;  // number of the last turn
  };

  bool goes_before(const Work& one, const Work& other) const;
  bool has_place(const Work& work) const;
  void forget_if_idle(const std::string& owner);

  const std::size_t places_;
  const std::chrono::milliseconds large_;
  Ticket last_ticket_ = 0;
  std::uint64_t turns_ = 0;
  std::size_t large_running_ = 0;
  std::vector<Work> waiting_;
  std::map<Ticket, Work> running_;
  std::map<std::string, Owner> owners_;  // with work that waits or runs, and for a while after
};

}  // namespace creased
