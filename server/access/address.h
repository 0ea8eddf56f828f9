#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace creased {

/// An IP address; IPv4 is kept as IPv4-mapped IPv6, so that both spellings of one host are one.
class Address {
 public:
  using Bytes = std::array<unsigned char, 16>;

  /// nullopt: the text is no address.
  static std::optional<Address> parse(std::string_view text);

  bool is_v4() const;
  bool is_loopback() const;
  std::string text() const;
  /// What one subscriber holds as a rule: an IPv4 address, the first 64 bits of an IPv6 address.
  std::string subscriber() const;
  const Bytes& bytes() const { return bytes_; }
  bool operator==(const Address&) const = default;

 private:
  Bytes bytes_{};
};

/// Addresses and blocks of addresses ("10.0.0.0/8").
class AddressList {
 public:
  AddressList() = default;
  /// \throw std::invalid_argument naming what is neither an address nor a block
  explicit AddressList(const std::vector<std::string>& texts);

  bool contains(const Address& address) const;

 private:
  struct Block {
    Address start;
    unsigned bits;
  };
  std::vector<Block> blocks_;
};

/// Who sent a request: the peer of the connection, or, as long as that is trusted, the one that it names last in
/// `forwarded_for` (the values of X-Forwarded-For, in order).
Address client_of(const Address& peer, std::string_view forwarded_for, const AddressList& trusted);

}  // namespace creased
