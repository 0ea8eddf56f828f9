#include "tests/service/service_fixture.h"

namespace crease::test {
namespace {

class Events : public ServiceTest {};

TEST_F(Events, AreProgressAndThenTheEndWithTheJob) {
  const auto submitted = server().submit(obj_text(icosphere(3)), "sweeps=200");
  const auto response = call("GET", path_of(submitted) + "/events");
  EXPECT_EQ(response.header("content-type"), "text/event-stream");
  EXPECT_EQ(response.header("cache-control"), "no-store");
  EXPECT_TRUE(response.body.starts_with("retry: ")) << response.body.substr(0, 40);
  const auto events = parse_events(response.body);
  ASSERT_GE(events.size(), 2U);
  double fraction = 0;
  std::uint64_t version = 0;
  for (std::size_t i = 0; i + 1 < events.size(); ++i) {
    EXPECT_EQ(events[i].type, "progress");
    const auto progress = nlohmann::json::parse(events[i].data);
    EXPECT_GE(progress["fraction"].get<double>(), fraction);
    fraction = progress["fraction"];
    EXPECT_GT(std::stoull(events[i].id), version);
    version = std::stoull(events[i].id);
  }
  EXPECT_EQ(events.back().type, "succeeded");
  const auto job = nlohmann::json::parse(events.back().data);
  EXPECT_EQ(job["id"], submitted["id"]);
  EXPECT_EQ(job["state"], "succeeded");
  EXPECT_EQ(job["links"]["mesh"], path_of(job) + "/mesh");
}

TEST_F(Events, OfAnEndedJobAreOnlyItsEnd) {
  const auto job = finished_job();
  const auto events = parse_events(call("GET", path_of(job) + "/events").body);
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].type, "succeeded");
}

TEST_F(Events, ResumeAfterTheLastEventSeen) {
  const auto job = finished_job();
  const auto last = parse_events(call("GET", path_of(job) + "/events").body).back();
  const auto before = std::to_string(std::stoull(last.id) - 1);
  const auto resumed = parse_events(call("GET", path_of(job) + "/events", {{"Last-Event-ID", before}}).body);
  ASSERT_EQ(resumed.size(), 1U);
  EXPECT_EQ(resumed[0].id, last.id);
  const auto nothing_left = call("GET", path_of(job) + "/events", {{"Last-Event-ID", last.id}});
  EXPECT_EQ(nothing_left.status, 204) << "ends the retries of an EventSource";
  EXPECT_EQ(parse_events(call("GET", path_of(job) + "/events", {{"Last-Event-ID", "x"}}).body).size(), 1U);
}

TEST_F(Events, DoNotRepeatEventsThatTheClientHasSeen) {
  const auto job = server().submit(obj_text(icosphere(4)), kLong);
  RawConnection first(port());
  first.send(raw_request("GET", path_of(job) + "/events"));
  ASSERT_FALSE(first.receive_until("event: progress").empty());
  std::string seen = first.receive_until("\n\n") + first.receive_until("\n\n");
  const auto id = std::stoull(seen.substr(seen.find("id: ") + 4));
  first.close();
  RawConnection second(port());
  second.send(raw_request("GET", path_of(job) + "/events", {{"Last-Event-ID", std::to_string(id)}}));
  const std::string head = second.receive_until("event: progress");
  EXPECT_GT(std::stoull(head.substr(head.find("id: ") + 4)), id);
  call("DELETE", path_of(job));
  EXPECT_NE(second.receive_until("removed").find(": the job was removed"), std::string::npos);
}

TEST_F(Events, EndWithCancelledWhenTheJobIsCancelled) {
  const auto job = server().submit(obj_text(icosphere(4)), kLong);
  RawConnection stream(port());
  stream.send(raw_request("GET", path_of(job) + "/events"));
  ASSERT_FALSE(stream.receive_until("event: progress").empty());
  EXPECT_LT(call("POST", path_of(job) + "/cancel").status, 300);
  EXPECT_NE(stream.receive_until("event: cancelled").find("event: cancelled"), std::string::npos);
}

TEST_F(Events, ReachHttp10ClientsWithoutChunks) {
  const auto job = finished_job();
  RawConnection connection(port());
  connection.send("GET " + path_of(job) + "/events HTTP/1.0\r\n\r\n");
  const auto response = connection.receive();
  EXPECT_EQ(response.headers.count("transfer-encoding"), 0U);
  EXPECT_EQ(parse_events(response.body).size(), 1U);
}

TEST_F(Events, AreTheSameForManyWatchers) {
  const auto job = server().submit(obj_text(icosphere(3)), "sweeps=100");
  std::vector<RawConnection> watchers;
  for (int i = 0; i < 20; ++i) {
    watchers.emplace_back(port());
    watchers.back().send(raw_request("GET", path_of(job) + "/events"));
  }
  for (auto& watcher : watchers) {
    const auto events = parse_events(watcher.receive().body);
    ASSERT_FALSE(events.empty());
    EXPECT_EQ(events.back().type, "succeeded");
  }
}

}  // namespace
}  // namespace crease::test
