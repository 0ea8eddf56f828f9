#include "server/access/address.h"

#include <arpa/inet.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <stdexcept>

#include "core/base/text.h"

namespace creased {
namespace {

using crease::trimmed;

constexpr std::array<unsigned char, 12> kMapped = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff};
constexpr unsigned kBits = 128, kMappedBits = 96, kSubscriberBits = 56, kSiteBits = 48;

bool same_start(const Address::Bytes& a, const Address::Bytes& b, unsigned bits) {
  const unsigned whole = bits / 8, rest = bits % 8;
  if (!std::equal(a.begin(), a.begin() + whole, b.begin())) return false;
  return rest == 0 || ((a[whole] ^ b[whole]) >> (8 - rest)) == 0;
}

bool is_port(std::string_view text) {
  return !text.empty() && text.size() <= 5 &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

/// An entry of X-Forwarded-For: an address, "203.0.113.7:4711", "[2001:db8::7]" or "[2001:db8::7]:4711".
std::optional<Address> parse_entry(std::string_view entry) {
  if (entry.starts_with('[')) {
    const auto end = entry.find(']');
    if (end == std::string_view::npos) return std::nullopt;
    const std::string_view rest = entry.substr(end + 1);
    if (!rest.empty() && !(rest.front() == ':' && is_port(rest.substr(1)))) return std::nullopt;
    const auto address = Address::parse(entry.substr(1, end - 1));
    return address && !address->is_v4() ? address : std::nullopt;
  }
  const auto colon = entry.find(':');
  const bool with_port =
      colon != std::string_view::npos && colon == entry.rfind(':') && is_port(entry.substr(colon + 1));
  return Address::parse(with_port ? entry.substr(0, colon) : entry);
}

std::string_view take_last(std::string_view& list) {
  const auto comma = list.rfind(',');
  const bool only = comma == std::string_view::npos;
  const std::string_view entry = trimmed(only ? list : list.substr(comma + 1));
  list = only ? std::string_view() : list.substr(0, comma);
  return entry;
}

}  // namespace

std::optional<Address> Address::parse(std::string_view text) {
  const std::string terminated(text);
  Address address;
  if (::inet_pton(AF_INET6, terminated.c_str(), address.bytes_.data()) == 1) return address;
  std::copy(kMapped.begin(), kMapped.end(), address.bytes_.begin());
  if (::inet_pton(AF_INET, terminated.c_str(), address.bytes_.data() + kMapped.size()) == 1) return address;
  return std::nullopt;
}

bool Address::is_v4() const { return std::equal(kMapped.begin(), kMapped.end(), bytes_.begin()); }

bool Address::is_loopback() const {
  static const Address v6 = *parse("::1");
  constexpr unsigned char kLoopbackNet = 127;
  return *this == v6 || (is_v4() && bytes_[kMapped.size()] == kLoopbackNet);
}

std::string Address::text() const {
  std::array<char, INET6_ADDRSTRLEN> text{};
  const bool v4 = is_v4();
  ::inet_ntop(v4 ? AF_INET : AF_INET6, bytes_.data() + (v4 ? kMapped.size() : 0), text.data(), text.size());
  return text.data();
}

std::string Address::net(unsigned bits) const {
  Address net = *this;
  std::fill(net.bytes_.begin() + bits / 8, net.bytes_.end(), static_cast<unsigned char>(0));
  return net.text() + "/" + std::to_string(bits);
}

std::string Address::subscriber() const { return is_v4() ? text() : net(kSubscriberBits); }

std::string Address::site() const { return is_v4() ? std::string() : net(kSiteBits); }

AddressList::AddressList(const std::vector<std::string>& texts) {
  for (const auto& text : texts) {
    const auto slash = text.find('/');
    const auto start = Address::parse(text.substr(0, slash));
    if (!start) throw std::invalid_argument("'" + text + "' is neither an address nor a block like 10.0.0.0/8");
    unsigned bits = kBits;
    if (slash != std::string::npos) {
      const char* const end = text.data() + text.size();
      const auto [stop, error] = std::from_chars(text.data() + slash + 1, end, bits);
      bits += start->is_v4() ? kMappedBits : 0;
      if (error != std::errc() || stop != end || bits > kBits) {
        throw std::invalid_argument("'" + text + "' has no valid prefix length after its slash");
      }
    }
    blocks_.push_back({*start, bits});
  }
}

bool AddressList::contains(const Address& address) const {
  return std::any_of(blocks_.begin(), blocks_.end(),
                     [&](const Block& block) { return same_start(block.start.bytes(), address.bytes(), block.bits); });
}

Origin client_of(const Address& peer, std::string_view forwarded_for, const AddressList& trusted) {
  Origin client{peer};
  while (!forwarded_for.empty() && trusted.contains(client.address)) {
    const auto named = parse_entry(take_last(forwarded_for));
    if (!named) return {client.address, false};
    client.address = *named;
  }
  return client;
}

bool is_local(const Address& peer, const std::optional<std::string>& forwarded_for, bool forwarded,
              const AddressList& trusted) {
  if (!forwarded_for && !forwarded) return peer.is_loopback();
  if (!forwarded_for || !trusted.contains(peer)) return false;
  std::string_view list = *forwarded_for;
  const auto last = parse_entry(take_last(list));
  return last && last->is_loopback();
}

}  // namespace creased
