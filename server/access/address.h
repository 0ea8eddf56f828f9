#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace creased {

/// An IP address. IPv4 is stored as IPv4-mapped IPv6, so that both spellings of an address are equal.
class Address {
 public:
  using Bytes = std::array<unsigned char, 16>;

  /// Returns nullopt when the text is not an address.
  static std::optional<Address> parse(std::string_view text);

  bool is_v4() const;
  bool is_loopback() const;
  std::string text() const;
  /// The part of the address that usually belongs to one subscriber: an IPv4 address, or the first 56 bits of an IPv6
  /// address.
  std::string subscriber() const;
  /// The first 48 bits of an IPv6 address, which one site may have; empty for IPv4.
  std::string site() const;
  const Bytes& bytes() const { return bytes_; }
  bool operator==(const Address&) const = default;

 private:
  std::string net(unsigned bits) const;

  Bytes bytes_{};
};

/// Addresses and blocks of addresses ("10.0.0.0/8").
class AddressList {
 public:
  AddressList() = default;
  /// \throw std::invalid_argument for a text that is neither an address nor a block
  explicit AddressList(const std::vector<std::string>& texts);

  bool contains(const Address& address) const;

 private:
  struct Block {
    Address start;
    unsigned bits;
  };
  std::vector<Block> blocks_;
};

/// Where a request comes from, as far as the peer of the connection and its proxies can be believed.
struct Origin {
  Address address;
  bool known = true;  ///< false when a trusted proxy has named something that is no address
};

/// The client of a request. It is the peer of the connection; while the address found so far is trusted, it is the one
/// before it in `forwarded_for`, the values of X-Forwarded-For read from the end. An entry may have a port.
Origin client_of(const Address& peer, std::string_view forwarded_for, const AddressList& trusted);

/// Whether a request comes from this machine: directly from loopback, or from loopback by the last entry that a trusted
/// proxy has added. `forwarded_for` is null without the header X-Forwarded-For; `forwarded` says whether there is a
/// header Forwarded, which is not read.
bool is_local(const Address& peer, const std::optional<std::string>& forwarded_for, bool forwarded,
              const AddressList& trusted);

}  // namespace creased
