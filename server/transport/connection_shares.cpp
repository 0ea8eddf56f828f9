#include "server/transport/connection_shares.h"

#include <algorithm>

namespace creased {

std::vector<std::string> ConnectionShares::names_of(const Address& address) {
  std::vector<std::string> names = {address.subscriber()};
  if (std::string site = address.site(); !site.empty()) names.push_back(std::move(site));
  return names;
}

std::size_t ConnectionShares::count(const std::string& name) const {
  const auto found = by_name_.find(name);
  return found == by_name_.end() ? 0 : found->second;
}

std::size_t ConnectionShares::share(std::size_t of_others) const {
  const std::size_t most = std::min(per_address_, in_all_), left = in_all_ - std::min(in_all_, of_others);
  return std::max<std::size_t>(1, most * left / in_all_);
}

bool ConnectionShares::has_place(const Address& address, bool bounded) const {
  if (is_full()) return false;
  if (!bounded || per_address_ == 0) return true;
  return std::ranges::all_of(names_of(address), [this](const std::string& name) {
    const std::size_t own = count(name);
    return own < share(all_ - own);
  });
}

void ConnectionShares::add(const Address& address) {
  ++all_;
  for (const std::string& name : names_of(address)) ++by_name_[name];
}

void ConnectionShares::remove(const Address& address) {
  --all_;
  for (const std::string& name : names_of(address)) {
    if (const auto found = by_name_.find(name); --found->second == 0) by_name_.erase(found);
  }
}

std::size_t ConnectionShares::count(const Address& address) const { return count(address.subscriber()); }

}  // namespace creased
