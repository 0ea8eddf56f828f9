#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/base/sanitized.h"
#include "tests/service/service_fixture.h"
#include "tests/support/store_audit.h"

namespace crease::test {
namespace fs = std::filesystem;
namespace {

/// A server of a user who has no other processes, and whose threads can be limited while it runs.
class ThreadLimits : public ::testing::Test {
 protected:
  void SetUp() override {
    if (kSanitized) GTEST_SKIP() << "sanitizers start threads of their own";
    if (::geteuid() != 0) GTEST_SKIP() << "needs root, to run as a user without other processes";
    std::vector<std::string> probe = as_user_, command = as_user_;
    probe.insert(probe.end(), {CREASED_BIN, "--version"});
    if (run_program(probe).exit_code != 0) GTEST_SKIP() << "other users cannot reach the program";
    const fs::path port_file = folder_.path() / "port";
    command.insert(command.end(),
                   {CREASED_BIN, "serve", "--port", "0", "--port-file", port_file, "--data-dir",
                    folder_.path() / "data", "--workers", "1", "--max-connections", "32", "--max-streams", "8"});
    server_ = std::make_unique<Program>(command);
    ASSERT_TRUE(eventually([&] { return server_->ended() || fs::exists(port_file); }));
    ASSERT_FALSE(server_->ended()) << server_->errors();
    port_ = std::stoi(read_file(port_file));
    EXPECT_EQ(end_of(submitted("sweeps=3"))["state"], "succeeded") << "all processes have started";
    worker_ = processes_below(server_->pid(), "worker").at(0);
  }

  std::string submitted(const std::string& query) const {
    const auto answer = exchange(port_, "POST", "/v1/jobs?" + query, {{"Content-Type", "model/obj"}}, small_obj());
    EXPECT_EQ(answer.status, 202) << answer.body;
    return answer.json()["id"].get<std::string>();
  }
  nlohmann::json end_of(const std::string& id) const {
    return nlohmann::json::parse(parse_events(exchange(port_, "GET", "/v1/jobs/" + id + "/events").body).back().data);
  }
  bool log_has(const std::string& text) const {
    return eventually([&] { return server_->errors().find(text) != std::string::npos; });
  }

  /// A process starts no thread, and no process, when its user has so many threads. Set as that user: root need not be
  /// allowed to.
  void limit_threads(int process, const std::string& most) const {
    std::vector<std::string> command = as_user_;
    command.insert(command.end(), {"/usr/bin/prlimit", "--pid", std::to_string(process), "--nproc=" + most + ":"});
    const Finished run = run_program(command);
    ASSERT_EQ(run.exit_code, 0) << run.errors;
  }

  static constexpr int kUser = 64'124;
  const std::vector<std::string> as_user_ = {"/usr/bin/setpriv",    "--reuid",       std::to_string(kUser), "--regid",
                                             std::to_string(kUser), "--clear-groups"};
  const PublicFolder folder_;
  std::unique_ptr<Program> server_;
  int port_ = 0, worker_ = 0;
};

TEST_F(ThreadLimits, AWorkerThatFindsNoThreadToKeepItsLeaseGoesOn) {
  limit_threads(worker_, "1");
  const std::string id = submitted("sweeps=3");
  EXPECT_TRUE(log_has("queued again: cannot start a thread"));
  limit_threads(worker_, "1000");
  const auto job = end_of(id);
  EXPECT_EQ(job["state"], "succeeded") << job;
  EXPECT_EQ(job["attempt"], 1);
  EXPECT_THAT(processes_below(server_->pid(), "worker"), testing::ElementsAre(worker_));
}

}  // namespace
}  // namespace crease::test
