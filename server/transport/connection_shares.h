#pragma once

#include <cstddef>
#include <string>
#include <unordered_map>
#include <vector>

#include "server/access/address.h"

namespace creased {

/// How many connections each address has, and may have. An address may hold as large a part of what the others leave
/// free as the limits give it of an idle server. So no two addresses can hold everything. An IPv6 network of 56 bits
/// counts as one address, and so do all of 48 bits together.
class ConnectionShares {
 public:
  /// At most `in_all` connections, and `per_address` from one address; 0 for no limit per address.
  ConnectionShares(std::size_t in_all, std::size_t per_address) : in_all_(in_all), per_address_(per_address) {}

  /// Whether another connection from this address has a place. `bounded` is false for addresses that only the limit for
  /// all concerns.
  bool has_place(const Address& address, bool bounded) const;
  bool is_full() const { return all_ >= in_all_; }
  void add(const Address& address);
  void remove(const Address& address);
  std::size_t count(const Address& address) const;

 private:
  static std::vector<std::string> names_of(const Address& address);
  std::size_t count(const std::string& name) const;
  std::size_t share(std::size_t of_others) const;

  const std::size_t in_all_, per_address_;
  std::size_t all_ = 0;
  std::unordered_map<std::string, std::size_t> by_name_;  // of addresses and networks
};

}  // namespace creased
