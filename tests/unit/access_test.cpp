#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>

#include "server/access/address.h"
#include "server/access/key.h"
#include "server/access/rate_limiter.h"
#include "tests/support/server_process.h"

namespace creased {
namespace {

using crease::test::TemporaryFolder;
using nlohmann::ordered_json;
using std::chrono::duration;
using std::chrono::seconds;
using testing::HasSubstr;

Address address(const std::string& text) { return Address::parse(text).value(); }

TEST(AddressTest, BothSpellingsOfAnIpv4AddressAreEqual) {
  EXPECT_EQ(address("192.0.2.1"), address("::ffff:192.0.2.1"));
  EXPECT_EQ(address("::ffff:192.0.2.1").text(), "192.0.2.1");
  for (const std::string none : {"", "localhost", "1.2.3", "1.2.3.4:80", "1.2.3.4/8", " 1.2.3.4", "::g"}) {
    EXPECT_FALSE(Address::parse(none)) << none;
  }
}

TEST(AddressTest, RecognisesLoopback) {
  for (const std::string text : {"127.0.0.1", "127.9.9.9", "::1", "::ffff:127.0.0.1"}) {
    EXPECT_TRUE(address(text).is_loopback()) << text;
  }
  for (const std::string text : {"128.0.0.1", "10.0.0.1", "::", "::2", "fe80::1"}) {
    EXPECT_FALSE(address(text).is_loopback()) << text;
  }
}

TEST(AddressTest, AnIpv6SubscriberIsANetwork) {
  EXPECT_EQ(address("2001:db8:1:2:3::4").subscriber(), address("2001:db8:1:2:ffff::").subscriber());
  EXPECT_EQ(address("2001:db8:1:2::4").subscriber(), address("2001:db8:1:ff::4").subscriber());
  EXPECT_NE(address("2001:db8:1:2::4").subscriber(), address("2001:db8:1:102::4").subscriber());
  EXPECT_EQ(address("2001:db8:1:2::4").site(), address("2001:db8:1:102::4").site());
  EXPECT_EQ(address("192.0.2.1").site(), "");
  EXPECT_NE(address("192.0.2.1").subscriber(), address("192.0.2.2").subscriber());
}

TEST(AddressListTest, MatchesAddressesAndBlocks) {
  const AddressList list({"192.0.2.1", "10.0.0.0/8", "172.16.0.0/12", "2001:db8::/33"});
  for (const std::string text : {"192.0.2.1", "::ffff:192.0.2.1", "10.255.0.1", "172.31.0.1", "2001:db8:7fff::"}) {
    EXPECT_TRUE(list.contains(address(text))) << text;
  }
  for (const std::string text : {"192.0.2.2", "11.0.0.1", "172.32.0.1", "2001:db8:8000::", "::1"}) {
    EXPECT_FALSE(list.contains(address(text))) << text;
  }
  EXPECT_FALSE(AddressList().contains(address("127.0.0.1")));
  for (const std::string bad : {"proxy", "10.0.0.0/33", "10.0.0.0/", "10.0.0.0/x", "::/129", "/8"}) {
    EXPECT_THROW(AddressList({bad}), std::invalid_argument) << bad;
  }
}

TEST(ClientOf, IsTakenFromTrustedProxiesOnly) {
  const AddressList trusted({"10.0.0.0/8"});
  const auto client = [&](const std::string& peer, const std::string& forwarded) {
    return client_of(address(peer), forwarded, trusted).address.text();
  };
  EXPECT_EQ(client("192.0.2.9", "203.0.113.1"), "192.0.2.9") << "anyone can send the header";
  EXPECT_EQ(client("10.0.0.1", "203.0.113.1"), "203.0.113.1");
  EXPECT_EQ(client("10.0.0.1", "6.6.6.6, 203.0.113.1"), "203.0.113.1") << "the client can send a header of its own";
  EXPECT_EQ(client("10.0.0.1", "6.6.6.6, 203.0.113.1, 10.0.0.2"), "203.0.113.1");
  EXPECT_EQ(client("10.0.0.1", "10.0.0.3 ,\t10.0.0.2"), "10.0.0.3");
  EXPECT_EQ(client("10.0.0.1", "203.0.113.1, unknown"), "10.0.0.1");
  EXPECT_EQ(client("10.0.0.1", "203.0.113.1,"), "10.0.0.1");
  EXPECT_EQ(client("10.0.0.1", ""), "10.0.0.1");
  EXPECT_EQ(client("10.0.0.1", "203.0.113.1:4711"), "203.0.113.1");
  EXPECT_EQ(client("10.0.0.1", "[2001:db8::7]:4711"), "2001:db8::7");
  EXPECT_EQ(client("10.0.0.1", "[2001:db8::7]"), "2001:db8::7");
}

TEST(IsLocal, OnlyDirectlyOrByTheLastEntryOfATrustedProxy) {
  const AddressList trusted({"127.0.0.1", "10.0.0.0/8"});
  const auto local = [&](const std::string& peer, const std::optional<std::string>& list, bool forwarded = false) {
    return is_local(address(peer), list, forwarded, trusted);
  };
  EXPECT_TRUE(local("127.0.0.1", std::nullopt));
  EXPECT_TRUE(local("::1", std::nullopt));
  EXPECT_FALSE(local("10.0.0.1", std::nullopt));
  EXPECT_TRUE(local("127.0.0.1", "127.0.0.1"));
  EXPECT_TRUE(local("10.0.0.1", "203.0.113.1, 127.0.0.1:4711"));
  EXPECT_TRUE(local("10.0.0.1", "[::1]:4711"));
  for (const char* odd : {"", " ", "unknown", "127.0.0.1,", "127.0.0.1, unknown", "127.0.0.1, 203.0.113.1", "_hidden",
                          "127.0.0.1:", "127.0.0.1:x", "[127.0.0.1]", "127.0.0.1, 203.0.113.1:80", "localhost"}) {
    EXPECT_FALSE(local("127.0.0.1", odd)) << odd;
  }
  EXPECT_FALSE(local("127.0.0.1", std::nullopt, true)) << "Forwarded is not read";
  EXPECT_FALSE(local("127.0.0.2", "127.0.0.1")) << "the peer is not trusted";
}

class RateLimiterTest : public testing::Test {
 protected:
  double wait(const std::string& who, double at) {
    return limiter_
        .take(who, rate_, start_ + std::chrono::duration_cast<RateLimiter::Clock::duration>(duration<double>(at)))
        .count();
  }
  RateLimiter limiter_{3};
  const Rate rate_{2, 3};  // two per second, bursts of three
  const RateLimiter::Clock::time_point start_ = RateLimiter::Clock::now();
};

TEST_F(RateLimiterTest, AllowsTheBurstAndThenTheRate) {
  for (int i = 0; i < 3; ++i) EXPECT_EQ(wait("a", 0), 0);
  EXPECT_NEAR(wait("a", 0), 0.5, 1e-6);
  EXPECT_NEAR(wait("a", 0.25), 0.25, 1e-6) << "a refused call costs nothing";
  EXPECT_EQ(wait("a", 0.5), 0);
  EXPECT_GT(wait("a", 0.5), 0);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(wait("a", 100), 0);
  EXPECT_GT(wait("a", 100), 0) << "unused calls add up to one burst at most";
}

TEST_F(RateLimiterTest, CountsEachCallerSeparately) {
  for (int i = 0; i < 4; ++i) wait("a", 0);
  EXPECT_GT(wait("a", 0), 0);
  EXPECT_EQ(wait("b", 0), 0);
}

TEST_F(RateLimiterTest, KeepsTheMostRecentlyUsedBuckets) {
  for (int i = 0; i < 4; ++i) wait("a", 0);
  for (int i = 0; i < 1'000; ++i) {
    wait("passer-by " + std::to_string(i), 0);
    EXPECT_GT(wait("a", 0), 0) << "a bucket in use was dropped";
    EXPECT_LE(limiter_.buckets(), 3U);
  }
}

TEST_F(RateLimiterTest, KeepsNoBucketWithoutARate) {
  for (int i = 0; i < 100; ++i) EXPECT_EQ(limiter_.take("a", Rate{}).count(), 0);
  EXPECT_EQ(limiter_.buckets(), 0U);
}

class KeyFile : public testing::Test {
 protected:
  std::filesystem::path file() const { return folder_.path() / "keys.json"; }
  void write(const std::string& text) const {
    std::ofstream(file()) << text;
    ::chmod(file().c_str(), 0600);
  }
  KeyRing read() const { return read_keys(file(), defaults_); }
  std::string fault() const {
    try {
      read();
      return "none";
    } catch (const KeyFileError& error) {
      return error.what();
    }
  }
  static std::string with(const std::string& member) {
    ordered_json entry = make_key("alice").entry;
    entry.update(ordered_json::parse("{" + member + "}"));
    return ordered_json{{"keys", {entry}}}.dump();
  }

  Limits defaults_{10, 100, 1'000, 20, 30, {5, 6}, 7};

 private:
  TemporaryFolder folder_;
};

TEST_F(KeyFile, AcceptsTheKeyAndNothingElse) {
  const NewKey alice = make_key("alice"), bob = make_key("bob");
  write(ordered_json{{"keys", {alice.entry, bob.entry}}}.dump());
  const KeyRing ring = read();
  ASSERT_NE(ring.find(alice.text), nullptr);
  EXPECT_EQ(ring.find(alice.text)->name, "alice");
  EXPECT_EQ(ring.find(bob.text)->id, bob.entry["id"]);
  const std::string id = alice.entry["id"], secret = alice.text.substr(alice.text.rfind('_'));
  std::string upper = alice.text;
  std::transform(upper.begin(), upper.end(), upper.begin(), [](unsigned char c) { return std::toupper(c); });
  for (const std::string& wrong :
       {std::string(), std::string("crk_"), id, "crk_" + id, "crk_" + id + "_", alice.text + "0", " " + alice.text,
        alice.text.substr(0, alice.text.size() - 1), "crk_" + bob.entry["id"].get<std::string>() + secret,
        "crk_0000000000000000" + secret, upper, alice.entry["sha256"].get<std::string>(), std::string(5'000, 'x')}) {
    EXPECT_EQ(ring.find(wrong), nullptr) << wrong;
  }
}

TEST_F(KeyFile, StoresOnlyTheHashOfAKey) {
  const NewKey key = make_key("alice");
  EXPECT_EQ(key.text.size(), 4U + 16 + 1 + 64) << "256 bits of secret";
  EXPECT_EQ(key.entry.dump().find(key.text.substr(key.text.rfind('_') + 1)), std::string::npos);
  EXPECT_NE(make_key("alice").text, key.text);
}

TEST_F(KeyFile, PrefersLimitsOfTheEntryToTheDefaults) {
  const NewKey plain = make_key("plain");
  NewKey own = make_key("own");
  own.entry.update(ordered_json{{"max_queued", 1},
                                {"max_upload_mb", 2},
                                {"max_faces", 3},
                                {"max_stored_mb", 4},
                                {"max_streams", 5},
                                {"requests_per_second", 0.5},
                                {"burst", 7},
                                {"jobs_per_minute", 8},
                                {"metrics", true}});
  write(ordered_json{{"keys", {plain.entry, own.entry}}}.dump());
  const auto of_plain = read().find(plain.text), of_own = read().find(own.text);
  EXPECT_EQ(of_plain->limits.max_queued, 10U);
  EXPECT_EQ(of_plain->limits.requests.burst, 6);
  EXPECT_EQ(of_plain->limits.jobs_per_minute, 7);
  EXPECT_FALSE(of_plain->metrics);
  EXPECT_EQ(of_own->limits.max_queued, 1U);
  EXPECT_EQ(of_own->limits.max_upload_mb, 2U);
  EXPECT_EQ(of_own->limits.max_faces, 3U);
  EXPECT_EQ(of_own->limits.max_stored_mb, 4U);
  EXPECT_EQ(of_own->limits.max_streams, 5U);
  EXPECT_EQ(of_own->limits.requests.per_second, 0.5);
  EXPECT_EQ(of_own->limits.requests.burst, 7);
  EXPECT_EQ(of_own->limits.jobs_per_minute, 8);
  EXPECT_TRUE(of_own->metrics);
}

TEST_F(KeyFile, NamesTheFaultAndItsEntry) {
  EXPECT_THAT(fault(), HasSubstr("does not exist"));
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "not JSON"},
      {"[]", "not JSON of the form"},
      {R"({"keys": {}})", "not JSON of the form"},
      {R"({"keys": [], "more": 1})", "not JSON of the form"},
      {R"({"keys": [1]})", "keys[0] is not an object"},
      {R"({"keys": [{}]})", "needs a string 'id'"},
      {with(R"("id": "a_b")"), "has an id"},
      {with(R"("name": "")"), "has a name"},
      {with(R"("sha256": "abc")"), "has a sha256"},
      {with(R"("max_queue": 1)"), "'max_queue'"},
      {with(R"("max_queued": "1")"), "'max_queued' that is not a number"},
      {with(R"("max_queued": 0)"), "max_queued = 0"},
      {with(R"("max_queued": 1.5)"), "max_queued = 1.5"},
      {with(R"("max_upload_mb": 101)"), "from 1 to 100"},
      {with(R"("max_faces": 1001)"), "from 1 to 1000"},
      {with(R"("requests_per_second": 0)"), "requests_per_second"},
      {with(R"("burst": 0.5)"), "burst"},
      {with(R"("metrics": "yes")"), "is not true or false"},
  };
  for (const auto& [text, reason] : cases) {
    write(text);
    EXPECT_THAT(fault(), HasSubstr(reason)) << text;
  }
  const ordered_json entry = make_key("alice").entry;
  write(ordered_json{{"keys", {entry, entry}}}.dump());
  EXPECT_THAT(fault(), HasSubstr("keys[1]"));
}

TEST_F(KeyFile, IsRefusedWhenOthersCanWriteIt) {
  write(R"({"keys": []})");
  EXPECT_EQ(fault(), "none");
  EXPECT_FALSE(readable_by_others(file()));
  ::chmod(file().c_str(), 0644);
  EXPECT_EQ(fault(), "none");
  EXPECT_TRUE(readable_by_others(file()));
  for (const mode_t mode : {0620U, 0602U}) {
    ::chmod(file().c_str(), mode);
    EXPECT_THAT(fault(), HasSubstr("can write the file")) << mode;
  }
}

TEST_F(KeyFile, TakesNewEntries) {
  const NewKey first = make_key("first"), second = make_key("second");
  add_key(file(), first.entry);
  add_key(file(), second.entry);
  EXPECT_NE(read().find(first.text), nullptr);
  EXPECT_NE(read().find(second.text), nullptr);
  EXPECT_FALSE(readable_by_others(file()));
  write("nonsense");
  EXPECT_THROW(add_key(file(), first.entry), KeyFileError) << "a file that cannot be parsed is left unchanged";
}

TEST(WithoutSecrets, KeepsTheIdAndRemovesTheSecret) {
  const NewKey key = make_key("alice");
  const std::string secret = key.text.substr(key.text.rfind('_') + 1);
  const std::string line = without_secrets("/v1/jobs?key=" + key.text + "&again=" + key.text);
  EXPECT_EQ(line.find(secret), std::string::npos) << line;
  EXPECT_THAT(line, HasSubstr(key.entry["id"].get<std::string>()));
  EXPECT_THAT(line, HasSubstr("&again="));
  for (const std::string plain : {"", "/v1/jobs", "crk_", "crk_abc", "/crk_abc_"}) {
    EXPECT_THAT(without_secrets(plain), HasSubstr(plain));
  }
}

}  // namespace
}  // namespace creased
