#include "server/transport/connection_shares.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace creased {
namespace {

constexpr std::size_t kAll = 1'500, kPerAddress = 1'250;

Address from_text(const std::string& text) { return Address::parse(text).value(); }

/// How many connections an address gets that takes all it can.
std::size_t grab(ConnectionShares& shares, const Address& from, bool bounded = true) {
  std::size_t got = 0;
  for (; shares.has_place(from, bounded); ++got) shares.add(from);
  return got;
}

TEST(ConnectionShares, TwoAddressesDoNotHoldAll) {
  ConnectionShares shares(kAll, kPerAddress);
  EXPECT_EQ(grab(shares, from_text("192.0.2.1")), kPerAddress);
  EXPECT_GT(grab(shares, from_text("192.0.2.2")), 0U);
  EXPECT_FALSE(shares.is_full());
  EXPECT_GT(grab(shares, from_text("192.0.2.3")), 0U);
}

TEST(ConnectionShares, ANetworkOf56BitsIsOneAddressAndOneOf48BitsHasNoMore) {
  ConnectionShares shares(kAll, kPerAddress);
  EXPECT_EQ(grab(shares, from_text("2001:db8:1::1")), kPerAddress);
  EXPECT_EQ(grab(shares, from_text("2001:db8:1:ff::2")), 0U) << "the same 56 bits";
  for (int net = 1; net < 256; ++net) {
    EXPECT_EQ(grab(shares, from_text(fmt::format("2001:db8:1:{:x}00::1", net))), 0U) << "the same 48 bits";
  }
  EXPECT_GT(grab(shares, from_text("2001:db8:2::1")), 0U);
}

TEST(ConnectionShares, WhoeverLeavesMakesRoom) {
  ConnectionShares shares(4, 2);
  const Address one = from_text("192.0.2.1"), other = from_text("192.0.2.2");
  EXPECT_EQ(grab(shares, one), 2U);
  EXPECT_EQ(shares.count(one), 2U);
  shares.remove(one);
  EXPECT_EQ(grab(shares, one), 1U);
  EXPECT_GT(grab(shares, other), 0U);
}

TEST(ConnectionShares, WithoutALimitPerAddressOneMayHoldAll) {
  ConnectionShares shares(10, 0), trusted(10, 2);
  EXPECT_EQ(grab(shares, from_text("192.0.2.1")), 10U);
  EXPECT_EQ(grab(trusted, from_text("192.0.2.1"), false), 10U);
  EXPECT_TRUE(trusted.is_full());
}

}  // namespace
}  // namespace creased
