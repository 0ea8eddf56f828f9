#include <gmock/gmock.h>

#include <fstream>
#include <regex>
#include <thread>

#include "core/base/sanitized.h"
#include "tests/service/service_fixture.h"

namespace crease::test {
namespace {

/// A number of kB in /proc/PID/status.
std::size_t status_kb(int process, const std::string& name) {
  const std::string text = read_file("/proc/" + std::to_string(process) + "/status");
  std::smatch match;
  return std::regex_search(text, match, std::regex(name + R"(:\s+(\d+) kB)")) ? std::stoul(match[1]) : 0;
}

class Encoding : public ::testing::Test {
 protected:
  std::string submit_large() {
    const auto job = server_.submit(obj_text(grid(250, 250)), "sweeps=1&solver=metropolis&threads=1");
    const std::string id = job["id"];
    EXPECT_EQ(server_.wait_for_state(id, "succeeded")["state"], "succeeded");
    return "/v1/jobs/" + id;
  }

  ServerProcess server_{{"--workers", "1", "--max-connections", "32", "--max-streams", "8"}};
};

// Its peak while results of some 10 MB are made and sent stays below what one of them would take.
TEST_F(Encoding, TheServerDoesNotGrowWithTheResultsThatItSends) {
  if (kSanitized) GTEST_SKIP() << "sanitizers keep memory that was freed";
  const std::string path = submit_large();
  const std::size_t before = status_kb(server_.pid(), "VmRSS");
  std::ofstream("/proc/" + std::to_string(server_.pid()) + "/clear_refs") << "5";  // the peak begins anew
  std::size_t bytes = 0;
  for (const char* part : {"/mesh.glb", "/mesh.ply", "/mesh.obj", "/labels.json", "/ridges.json", "/report"}) {
    const auto answer = server_.get(path + part);
    EXPECT_EQ(answer.status, 200) << part;
    bytes += answer.body.size();
  }
  const std::size_t peak = status_kb(server_.pid(), "VmHWM");
  EXPECT_GT(bytes, 12U << 20U);
  EXPECT_LT(peak, before + 12 * 1024) << "kB, of " << before << " before";
}

TEST_F(Encoding, ManyWhoAskForTheSameGetTheSame) {
  const std::string path = submit_large();
  std::vector<std::string> bodies(6);
  {
    std::vector<std::jthread> callers;
    for (auto& body : bodies) callers.emplace_back([&] { body = server_.get(path + "/mesh.ply").body; });
  }
  for (const auto& body : bodies) EXPECT_TRUE(!body.empty() && body == bodies.front());
}

TEST_F(Encoding, ADownloadWhoseClientLeavesLeavesTheServerWell) {
  const std::string path = submit_large();
  for (int i = 0; i < 8; ++i) {
    RawConnection leaving(server_.port());
    leaving.send(raw_request("GET", path + "/mesh.obj?measured=true"));
  }
  EXPECT_EQ(server_.get(path + "/mesh.obj").status, 200);
}

}  // namespace
}  // namespace crease::test
