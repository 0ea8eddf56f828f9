#include <algorithm>
#include <cstdio>
#include <fstream>

#include "core/base/sanitized.h"
#include "tests/service/service_fixture.h"
#include "tests/support/key_file.h"

namespace crease::test {
namespace {

const Headers kObj = {{"Content-Type", "model/obj"}};

/// A service without workers, so that jobs stay queued. Each limit has a key that reaches it first.
class Limits : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    file_ = std::make_unique<TestKeyFile>(
        std::vector<TestKey>{kFree, kSlow, kSteady, kJobs, kQueue, kBytes, kFaces, kStored, kStreams});
    server_ = std::make_unique<ServerProcess>(std::vector<std::string>{
        "--workers", "0", "--max-connections", "48", "--max-streams", "16", "--keys", file_->path(), "--max-upload-mb",
        "2", "--trusted-proxy", "127.0.0.1", "--address-rate", "0.001", "--address-burst", "2", "--key-rate", "0"});
  }
  static void TearDownTestSuite() {
    server_.reset();
    file_.reset();
  }
  static RawResponse call(const std::string& method, const std::string& target, const Headers& headers = {},
                          const std::string& body = {}) {
    return exchange(server_->port(), method, target, headers, body);
  }
  static RawResponse submit(const TestKey& key, int seed, const std::string& obj = small_obj()) {
    return call("POST", fmt::format("/v1/jobs?sweeps=1&seed={}", seed), key.with(kObj), obj);
  }
  /// The seconds after which to come again; -1: not said.
  static int retry_after(const RawResponse& response) {
    const std::string value = response.header("retry-after");
    return value.empty() ? -1 : std::stoi(value);
  }

  static inline const TestKey kFree = make_test_key("free"),
                              kSlow = make_test_key("slow", {{"requests_per_second", 0.001}, {"burst", 3}}),
                              kSteady = make_test_key("steady", {{"requests_per_second", 1}, {"burst", 1}}),
                              kJobs = make_test_key("jobs", {{"jobs_per_minute", 0.1}}),
                              kQueue = make_test_key("queue", {{"max_queued", 2}}),
                              kBytes = make_test_key("bytes", {{"max_upload_mb", 1}}),
                              kFaces = make_test_key("faces", {{"max_faces", 191}}),
                              kStored = make_test_key("stored", {{"max_stored_mb", 1}}),
                              kStreams = make_test_key("streams", {{"max_streams", 1}});
  static inline std::unique_ptr<TestKeyFile> file_;
  static inline std::unique_ptr<ServerProcess> server_;
};

TEST_F(Limits, CallsOfAKeyAreLimitedToItsRate) {
  for (int i = 0; i < 3; ++i) EXPECT_EQ(call("GET", "/v1/jobs", kSlow.bearer()).status, 200);
  const auto refused = call("GET", "/v1/jobs", kSlow.bearer());
  EXPECT_EQ(refused.status, 429);
  EXPECT_EQ(refused.code(), "rate_limited");
  EXPECT_GT(retry_after(refused), 1);
  EXPECT_LE(retry_after(refused), 1000) << "one call per thousand seconds";
  EXPECT_EQ(call("POST", "/v1/jobs", kSlow.with(kObj), small_obj()).code(), "rate_limited");
  EXPECT_EQ(call("GET", "/healthz", kSlow.bearer()).status, 200) << "probes are not counted";
  EXPECT_EQ(call("GET", "/v1/jobs", kFree.bearer()).status, 200) << "other keys are not affected";
}

TEST_F(Limits, ARefusedKeyIsServedAgainLater) {
  RawResponse refused;
  EXPECT_TRUE(eventually([&] {
    refused = call("GET", "/v1/jobs", kSteady.bearer());
    return refused.status == 429;
  }));
  EXPECT_EQ(retry_after(refused), 1);
  EXPECT_TRUE(eventually([] { return call("GET", "/v1/jobs", kSteady.bearer()).status == 200; }));
}

TEST_F(Limits, JobsOfAKeyAreLimitedToItsRate) {
  EXPECT_EQ(submit(kJobs, 1).status, 202);
  const auto refused = submit(kJobs, 2);
  EXPECT_EQ(refused.code(), "rate_limited");
  EXPECT_GT(retry_after(refused), 60);
  EXPECT_LE(retry_after(refused), 600) << "one per ten minutes";
  EXPECT_EQ(call("GET", "/v1/jobs", kJobs.bearer()).status, 200);
}

TEST_F(Limits, CallsWithoutAKeyAreCountedByAddress) {
  const auto from = [](const std::string& address, const std::string& target = "/v1/jobs") {
    return call("GET", target, {{"X-Forwarded-For", address}});
  };
  EXPECT_EQ(from("203.0.113.1").status, 401);
  EXPECT_EQ(from("203.0.113.1", "/openapi.json").status, 200);
  const auto refused = from("203.0.113.1");
  EXPECT_EQ(refused.code(), "rate_limited");
  EXPECT_GT(retry_after(refused), 60);
  EXPECT_LE(retry_after(refused), 1000) << "one per thousand seconds";
  EXPECT_EQ(from("198.51.100.1, 203.0.113.1").code(), "rate_limited") << "addresses that a client claims do not count";
  EXPECT_EQ(from("203.0.113.2").status, 401);
  EXPECT_EQ(from("2001:db8::1").status, 401);
  EXPECT_EQ(from("2001:db8::2").status, 401);
  EXPECT_EQ(from("2001:db8::3").status, 429) << "a network is one subscriber";
  EXPECT_EQ(from("203.0.113.1", "/readyz").status, 200);
  const Headers with_key = kFree.with({{"X-Forwarded-For", "203.0.113.1"}});
  EXPECT_EQ(call("GET", "/v1/jobs", with_key).status, 200) << "a caller with a key is not affected by its neighbours";
}

TEST_F(Limits, QueuedJobsOfAKeyAreLimited) {
  const auto first = submit(kQueue, 1);
  EXPECT_EQ(first.status, 202);
  EXPECT_EQ(submit(kQueue, 2).status, 202);
  const auto refused = submit(kQueue, 3);
  EXPECT_EQ(refused.status, 429);
  EXPECT_EQ(refused.code(), "key_queue_full");
  EXPECT_GE(retry_after(refused), 1);
  EXPECT_EQ(submit(kFree, 3).status, 202);
  call("DELETE", first.header("location"), kQueue.bearer());
  EXPECT_EQ(submit(kQueue, 3).status, 202);
}

TEST_F(Limits, UploadsOfAKeyAreLimitedByTheirLengthAndWhileTheyArrive) {
  const std::string long_obj = small_obj() + "#" + std::string(1'200'000, ' ') + "\n";
  EXPECT_EQ(submit(kBytes, 1, long_obj).code(), "payload_too_large");
  EXPECT_EQ(submit(kFree, 1, long_obj).status, 202);
  EXPECT_EQ(submit(kBytes, 1).status, 202);

  RawConnection head_only(server_->port());
  head_only.send("POST /v1/jobs HTTP/1.1\r\nHost: x\r\nContent-Length: 1200000\r\nAuthorization: Bearer " +
                 kBytes.text + "\r\n\r\n");
  EXPECT_EQ(head_only.receive().code(), "payload_too_large") << "before a byte of the body";

  RawConnection chunks(server_->port());
  chunks.send(
      "POST /v1/jobs HTTP/1.1\r\nHost: x\r\nContent-Type: model/obj\r\nTransfer-Encoding: chunked\r\n"
      "Authorization: Bearer " +
      kBytes.text + "\r\n\r\n");
  const std::string chunk = "10000\r\n" + std::string(0x10000, ' ') + "\r\n";
  for (int i = 0; i < 40 && chunks.send(chunk); ++i) {
  }
  EXPECT_EQ(chunks.receive().code(), "payload_too_large");
}

TEST_F(Limits, FacesOfAKeysMeshesAreLimited) {
  const auto refused = submit(kFaces, 1);
  EXPECT_EQ(refused.status, 413);
  EXPECT_EQ(refused.code(), "mesh_too_large");
  EXPECT_NE(refused.json()["detail"].get<std::string>().find("191"), std::string::npos) << refused.body;
  EXPECT_EQ(submit(kFaces, 1, obj_text(cube(2))).status, 202);
}

TEST_F(Limits, StoredBytesOfAKeyAreLimited) {
  RawResponse response;
  int taken = 0;
  while (taken < 30 && (response = submit(kStored, taken)).status == 202) ++taken;
  EXPECT_GT(taken, 1);
  EXPECT_EQ(response.status, 507);
  EXPECT_EQ(response.code(), "quota_exceeded");
  EXPECT_EQ(submit(kFree, 99).status, 202);
  const auto kept = call("GET", "/v1/jobs", kStored.bearer()).json()["jobs"];
  EXPECT_EQ(kept.size(), static_cast<std::size_t>(taken));
  call("DELETE", "/v1/jobs/" + kept[0]["id"].get<std::string>(), kStored.bearer());
  EXPECT_EQ(submit(kStored, 100).status, 202) << "deleting jobs makes room";
}

TEST_F(Limits, StreamsOfAKeyAreLimited) {
  const std::string events = submit(kStreams, 1).header("location") + "/events";
  {
    RawConnection first(server_->port());
    first.send(raw_request("GET", events, kStreams.bearer()));
    ASSERT_FALSE(first.receive_until("retry:").empty());
    const auto refused = call("GET", events, kStreams.bearer());
    EXPECT_EQ(refused.status, 429);
    EXPECT_EQ(refused.code(), "key_streams_full");
    EXPECT_GE(retry_after(refused), 1);
    RawConnection other(server_->port());
    other.send(raw_request("GET", submit(kFree, 77).header("location") + "/events", kFree.bearer()));
    EXPECT_NE(other.receive_until("retry:").find("200 OK"), std::string::npos);
  }
  EXPECT_TRUE(eventually([&] {
    RawConnection again(server_->port());
    again.send(raw_request("GET", events, kStreams.bearer()));
    return again.receive_until("\r\n").find("200") != std::string::npos;
  }));
}

TEST(ServiceLimits, AFullQueueSaysWhenToTryAgain) {
  ServerProcess server({"--workers", "0", "--max-connections", "16", "--max-streams", "4", "--max-queued", "1"});
  server.submit(small_obj(), "seed=1");
  const auto refused = exchange(server.port(), "POST", "/v1/jobs?seed=2", kObj, small_obj());
  EXPECT_EQ(refused.status, 503);
  EXPECT_EQ(refused.code(), "queue_full");
  EXPECT_FALSE(refused.header("retry-after").empty());
}

TEST(ServiceLimits, AddressesOfAnOpenServiceAreCountedButThisMachineIsNot) {
  ServerProcess server({"--workers", "0", "--max-connections", "16", "--max-streams", "4", "--trusted-proxy",
                        "127.0.0.1", "--address-rate", "0.001", "--address-burst", "1"});
  for (int i = 0; i < 20; ++i) EXPECT_EQ(server.get("/v1/jobs").status, 200);
  const Headers far = {{"X-Forwarded-For", "203.0.113.1"}};
  EXPECT_EQ(server.get("/v1/jobs", far).status, 200);
  EXPECT_EQ(server.get("/v1/jobs", far).status, 429);
}

/// Connections from one address of 127.0.0.0/8 until the service refuses them.
class AddressConnections : public ::testing::Test {
 protected:
  static constexpr int kBound = 4;

  explicit AddressConnections(const std::vector<std::string>& more = {}) {
    std::vector<std::string> flags = {"--workers",
                                      "0",
                                      "--max-connections",
                                      "32",
                                      "--max-streams",
                                      "8",
                                      "--head-timeout",
                                      "10000",
                                      "--max-connections-per-address",
                                      std::to_string(kBound)};
    flags.insert(flags.end(), more.begin(), more.end());
    server_ = std::make_unique<ServerProcess>(flags);
  }
  int port() const { return server_->port(); }
  RawConnection busy(const std::string& source) const {
    RawConnection connection(port(), source);
    connection.send(raw_request("GET", "/healthz"));
    EXPECT_EQ(connection.receive().status, 200);
    connection.send("GET /hea");  // an incomplete head
    return connection;
  }
  RawResponse one_more(const std::string& source) const {
    RawConnection connection(port(), source);
    connection.send(raw_request("GET", "/healthz"));
    return connection.receive();
  }

 private:
  std::unique_ptr<ServerProcess> server_;
};

class UntrustedConnections : public AddressConnections {};

TEST_F(UntrustedConnections, AreRefusedOverTheLimitAndOtherAddressesAreServed) {
  {
    std::vector<RawConnection> held;
    for (int i = 0; i < kBound; ++i) held.push_back(busy("127.0.0.2"));
    const auto refused = one_more("127.0.0.2");
    EXPECT_EQ(refused.status, 429);
    EXPECT_EQ(refused.code(), "address_connections_full");
    EXPECT_FALSE(refused.header("retry-after").empty());
    EXPECT_EQ(refused.header("connection"), "close");
    for (int i = 0; i < 200; ++i) RawConnection(port(), "127.0.0.2").send("GET /hea");
    EXPECT_EQ(one_more("127.0.0.3").status, 200);
    EXPECT_EQ(one_more("").status, 200);
  }
  EXPECT_TRUE(eventually([&] { return one_more("127.0.0.2").status == 200; }));
}

class TrustedConnections : public AddressConnections {
 protected:
  TrustedConnections() : AddressConnections({"--trusted-proxy", "127.0.0.2"}) {}
};

TEST_F(TrustedConnections, OfAProxyAreNotLimited) {
  std::vector<RawConnection> held;
  for (int i = 0; i < 3 * kBound; ++i) held.push_back(busy("127.0.0.2"));
  EXPECT_EQ(one_more("127.0.0.2").status, 200);
}

/// The limits of address space, in bytes, of all processes below one.
std::vector<std::uint64_t> memory_limits_below(int process) {
  std::vector<std::uint64_t> found;
  for (const int child : children_of(process)) {
    std::ifstream limits(fmt::format("/proc/{}/limits", child));
    for (std::string line; std::getline(limits, line);) {
      std::uint64_t bytes = 0;
      if (std::sscanf(line.c_str(), "Max address space %lu", &bytes) == 1) found.push_back(bytes);
    }
    const auto below = memory_limits_below(child);
    found.insert(found.end(), below.begin(), below.end());
  }
  return found;
}

/// What a job may need is estimated from its mesh before it is accepted, and is the limit of its process.
TEST(JobMemory, IsEstimatedForAdmissionAndForTheProcess) {
  constexpr std::uint64_t kMiB = 1U << 20U;
  const ServerProcess server(
      {"--workers", "1", "--threads", "1", "--job-memory-mb", "64", "--max-connections", "16", "--max-streams", "4"});
  const auto refused = exchange(server.port(), "POST", "/v1/jobs?name=large.obj", kObj, obj_text(cube(30)));
  EXPECT_EQ(refused.status, 413) << refused.body;
  EXPECT_EQ(refused.code(), "mesh_too_large");
  EXPECT_EQ(refused.json()["field"], "mesh");
  EXPECT_EQ(refused.json()["value"], "5402 vertices and 10800 faces");
  EXPECT_TRUE(refused.json()["expected"].get<std::string>().starts_with("a mesh whose job needs at most 64 MiB"));
  EXPECT_TRUE(server.get("/v1/jobs").json()["jobs"].empty());

  const auto fits = server.submit(obj_text(cube(24)), "");
  EXPECT_EQ(server.wait_for_end(fits["id"].get<std::string>())["state"], "succeeded") << "within its own estimate";

  if (kSanitized) return;  // sanitizers reserve more address space than any limit
  const auto small = server.submit(obj_text(icosphere(3)), "sweeps=10000");
  EXPECT_TRUE(eventually([&] {
    const auto limits = memory_limits_below(server.pid());
    return std::ranges::any_of(limits, [](std::uint64_t bytes) { return bytes > 50 * kMiB && bytes < 60 * kMiB; });
  })) << "what the small job needs, and not what the service allows";
  exchange(server.port(), "POST", "/v1/jobs/" + small["id"].get<std::string>() + "/cancel");
}

}  // namespace
}  // namespace crease::test
