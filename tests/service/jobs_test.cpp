#include <set>

#include "tests/service/service_fixture.h"

namespace crease::test {
namespace {

class Jobs : public ServiceTest {};

TEST_F(Jobs, GoFromQueuedToSucceededWithTheirFacts) {
  const auto submitted = server().submit(small_obj(), kQuick);
  EXPECT_EQ(submitted["state"], "queued");
  EXPECT_FALSE(submitted.contains("started_at"));
  const auto job = server().wait_for_end(submitted["id"]);
  EXPECT_EQ(job["state"], "succeeded");
  EXPECT_EQ(job["attempt"], 1);
  EXPECT_EQ(job["progress"]["fraction"], 1.0);
  EXPECT_EQ(job["input"]["vertices"], 98);
  EXPECT_EQ(job["input"]["components"], 1);
  EXPECT_GE(job["finished_at"].get<std::string>(), job["started_at"].get<std::string>());
  EXPECT_GE(job["started_at"].get<std::string>(), job["created_at"].get<std::string>());
  EXPECT_GE(job["result"]["max_displacement"].get<double>(), job["result"]["rms_displacement"].get<double>());
  EXPECT_EQ(call("GET", path_of(job)).json(), job);
}

TEST_F(Jobs, AreListedNewestFirstInPages) {
  std::vector<std::string> submitted;
  for (int seed = 100; seed < 105; ++seed) {
    submitted.push_back(server().submit(small_obj(), fmt::format("sweeps=1&seed={}", seed))["id"]);
  }
  std::vector<std::string> listed;
  std::string cursor;
  do {
    const auto page = call("GET", "/v1/jobs?limit=2" + (cursor.empty() ? "" : "&cursor=" + cursor)).json();
    EXPECT_LE(page["jobs"].size(), 2U);
    for (const auto& job : page["jobs"]) listed.push_back(job["id"]);
    cursor = page.value("next_cursor", "");
  } while (!cursor.empty() && listed.size() < 100);
  ASSERT_GE(listed.size(), 5U);
  EXPECT_TRUE(std::equal(submitted.rbegin(), submitted.rend(), listed.begin()));
  EXPECT_EQ(std::set<std::string>(listed.begin(), listed.end()).size(), listed.size());
}

TEST_F(Jobs, AreListedByState) {
  const auto job = finished_job();
  const auto page = call("GET", "/v1/jobs?state=succeeded").json();
  EXPECT_FALSE(page["jobs"].empty());
  for (const auto& one : page["jobs"]) EXPECT_EQ(one["state"], "succeeded");
  EXPECT_TRUE(call("GET", "/v1/jobs?state=failed").json()["jobs"].empty());
}

TEST_F(Jobs, AreCancelledWithinASweep) {
  const auto job = server().submit(obj_text(icosphere(4)), kLong);
  server().wait_for_state(job["id"], "running");
  const auto response = call("POST", path_of(job) + "/cancel");
  EXPECT_TRUE(response.status == 202 || response.status == 200) << response.status;
  const auto ended = server().wait_for_end(job["id"]);
  EXPECT_EQ(ended["state"], "cancelled");
  const auto again = call("POST", path_of(job) + "/cancel");
  EXPECT_EQ(again.status, 200) << "an ended job stays as it is";
  EXPECT_EQ(again.json()["state"], "cancelled");
}

TEST_F(Jobs, AreCancelledAtOnceWhileQueued) {
  const auto running = server().submit(obj_text(icosphere(4)), kLong);
  server().wait_for_state(running["id"], "running");  // or else the small job passes it
  const auto waiting = server().submit(small_obj(), "sweeps=4");
  const auto response = call("POST", path_of(waiting) + "/cancel");
  EXPECT_EQ(response.status, 200);
  EXPECT_EQ(response.json()["state"], "cancelled");
  EXPECT_EQ(call("DELETE", path_of(running)).status, 204);
}

TEST_F(Jobs, LeaveNothingWhenDeleted) {
  const auto job = finished_job();
  call("GET", path_of(job) + "/mesh");
  EXPECT_EQ(call("DELETE", path_of(job)).status, 204);
  EXPECT_EQ(call("GET", path_of(job)).code(), "job_not_found");
  EXPECT_EQ(call("GET", path_of(job) + "/mesh").code(), "job_not_found");
  EXPECT_EQ(call("DELETE", path_of(job)).code(), "job_not_found");
  const std::string id = job["id"];
  for (const auto& entry : std::filesystem::recursive_directory_iterator(server().data_dir())) {
    EXPECT_EQ(entry.path().string().find(id), std::string::npos) << entry.path();
  }
}

TEST_F(Jobs, AreAbandonedWhenDeletedWhileRunning) {
  const auto running = server().submit(obj_text(icosphere(4)), kLong);
  server().wait_for_state(running["id"], "running");
  EXPECT_EQ(call("DELETE", path_of(running)).status, 204);
  EXPECT_EQ(finished_job()["state"], "succeeded");
}

}  // namespace
}  // namespace crease::test
