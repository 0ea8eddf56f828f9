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
constexpr unsigned kBits = 128, kMappedBits = 96, kSubscriberBits = 64;

bool same_start(const Address::Bytes& a, const Address::Bytes& b, unsigned bits) {
  const unsigned whole = bits / 8, rest = bits % 8;
  if (!std::equal(a.begin(), a.begin() + whole, b.begin())) return false;
  return rest == 0 || ((a[whole] ^ b[whole]) >> (8 - rest)) == 0;
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

std::string Address::subscriber() const {
  if (is_v4()) return text();
  Address net = *this;
  std::fill(net.bytes_.begin() + kSubscriberBits / 8, net.bytes_.end(), static_cast<unsigned char>(0));
  return net.text() + "/64";
}

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

Address client_of(const Address& peer, std::string_view forwarded_for, const AddressList& trusted) {
  Address client = peer;
  while (!forwarded_for.empty() && trusted.contains(client)) {
    const auto comma = forwarded_for.rfind(',');
    const bool last = comma == std::string_view::npos;
    const auto named = Address::parse(trimmed(last ? forwarded_for : forwarded_for.substr(comma + 1)));
    if (!named) break;
    client = *named;
    forwarded_for = last ? std::string_view() : forwarded_for.substr(0, comma);
  }
  return client;
}

}  // namespace creased
