#include "tests/service/service_fixture.h"

namespace crease::test {
namespace {

std::vector<RawConnection> open_streams(int port, const std::string& id, int count) {
  std::vector<RawConnection> streams;
  for (int i = 0; i < count; ++i) {
    streams.emplace_back(port);
    streams.back().send(raw_request("GET", "/v1/jobs/" + id + "/events"));
  }
  return streams;
}

TEST(Streams, ThreeHundredOpenStreamsDoNotBlockOtherCalls) {
  ServerProcess server({"--workers", "1"});
  const auto job = server.submit(obj_text(icosphere(4)), kLong);
  auto streams = open_streams(server.port(), job["id"], 300);
  for (auto& stream : streams) ASSERT_FALSE(stream.receive_until("event: progress").empty());
  const auto open = [&] { return server.get("/metrics").body.find("creased_event_streams 300") != std::string::npos; };
  EXPECT_TRUE(open());

  for (int i = 0; i < 20; ++i) ASSERT_EQ(server.get("/healthz").status, 200);
  EXPECT_EQ(server.get("/v1/jobs").status, 200);
  EXPECT_EQ(server.submit(small_obj(), kQuick)["state"], "queued");
  EXPECT_TRUE(open()) << "they were answered without waiting for a stream to end";

  EXPECT_LT(exchange(server.port(), "POST", "/v1/jobs/" + job["id"].get<std::string>() + "/cancel").status, 300);
  for (auto& stream : streams) {
    EXPECT_NE(stream.receive_until("event: cancelled").find("event: cancelled"), std::string::npos);
  }
}

TEST(Streams, AreRefusedOverTheLimitUntilOneIsFree) {
  ServerProcess server({"--workers", "0", "--max-streams", "5", "--max-connections", "32"});
  const std::string id = server.submit(small_obj(), kQuick)["id"];
  auto streams = open_streams(server.port(), id, 5);
  for (auto& stream : streams) ASSERT_FALSE(stream.receive_until("event: progress").empty());
  const auto refused = server.get("/v1/jobs/" + id + "/events");
  EXPECT_EQ(refused.status, 503);
  EXPECT_EQ(refused.code(), "too_many_streams");
  EXPECT_EQ(refused.header("retry-after"), "1");

  streams.pop_back();
  EXPECT_TRUE(eventually([&] {
    RawConnection one(server.port());
    one.send(raw_request("GET", "/v1/jobs/" + id + "/events"));
    return one.receive_until("\r\n").starts_with("HTTP/1.1 200");
  })) << "a client that disconnects frees its slot";
}

}  // namespace
}  // namespace crease::test
