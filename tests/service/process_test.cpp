#include <csignal>
#include <fstream>
#include <sstream>

#include "tests/service/service_fixture.h"

namespace crease::test {
namespace {

TEST(Process, APortInUseIsAnError) {
  ServerProcess server({"--workers", "0", "--max-connections", "16", "--max-streams", "4"});
  const TemporaryFolder folder;
  const auto second = run_program({CREASED_BIN, "serve", "--workers", "0", "--port", std::to_string(server.port()),
                                   "--data-dir", (folder.path() / "data").string()});
  EXPECT_EQ(second.exit_code, 1);
  EXPECT_NE(second.errors.find("in use"), std::string::npos) << second.errors;
  EXPECT_NE(second.errors.find(std::to_string(server.port())), std::string::npos) << second.errors;
}

TEST(Process, ListensBeyondLoopbackOnlyWithKeysOrOpen) {
  const auto refused = run_program({CREASED_BIN, "serve", "--host", "0.0.0.0", "--port", "0"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.errors.find("--open"), std::string::npos) << refused.errors;
  ServerProcess open(
      {"--host", "0.0.0.0", "--open", "--workers", "0", "--max-connections", "16", "--max-streams", "4"});
  EXPECT_EQ(open.get("/healthz").status, 200);
}

TEST(Process, InvalidFlagsAreUsageErrors) {
  EXPECT_EQ(run_program({CREASED_BIN}).exit_code, 2);
  EXPECT_EQ(run_program({CREASED_BIN, "serve", "--no-such-flag"}).exit_code, 2);
  EXPECT_EQ(run_program({CREASED_BIN, "serve", "--port", "65536"}).exit_code, 2);
  EXPECT_EQ(run_program({CREASED_BIN, "serve", "--log-format", "xml"}).exit_code, 2);
  EXPECT_EQ(run_program({CREASED_BIN, "serve", "--max-streams", "9", "--max-connections", "9"}).exit_code, 2);
}

TEST(Process, HelpListsEveryFlagWithDefaultAndEnvironment) {
  const auto help = run_program({CREASED_BIN, "serve", "--help"});
  EXPECT_EQ(help.exit_code, 0);
  for (const std::string flag : {"host", "port", "port-file", "data-dir", "store", "workers", "max-upload-mb",
                                 "max-faces", "max-vertices", "max-queued", "max-streams", "max-connections",
                                 "head-timeout", "body-timeout", "idle-timeout", "log-format", "log-level", "open"}) {
    std::string variable = "CREASED_" + flag;
    std::transform(variable.begin(), variable.end(), variable.begin(),
                   [](unsigned char c) { return c == '-' ? '_' : static_cast<char>(std::toupper(c)); });
    EXPECT_NE(help.output.find("--" + flag), std::string::npos) << flag;
    EXPECT_NE(help.output.find(variable), std::string::npos) << variable;
  }
  EXPECT_NE(help.output.find("127.0.0.1"), std::string::npos);
  EXPECT_NE(help.output.find("8080"), std::string::npos);
}

TEST(Process, TakesOptionsFromAFile) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "creased.toml";
  std::ofstream(file) << "[serve]\nmax-upload-mb = 1\nworkers = 0\nmax-connections = 16\nmax-streams = 4\n";
  ServerProcess server({"--config", file.string()});
  const auto response = exchange(server.port(), "POST", "/v1/jobs", {}, std::string(2'000'000, ' '));
  EXPECT_EQ(response.code(), "payload_too_large");
}

TEST(Process, DrainsOnSigtermWithOpenStreamsAndIdleConnections) {
  ServerProcess server({"--workers", "1", "--max-connections", "32", "--max-streams", "8", "--idle-timeout", "10000"});
  const auto job = server.submit(obj_text(icosphere(4)), kLong);
  server.wait_for_state(job["id"], "running");
  RawConnection idle(server.port()), stream(server.port());
  idle.send(raw_request("GET", "/readyz"));
  ASSERT_EQ(idle.receive().status, 200);
  stream.send(raw_request("GET", "/v1/jobs/" + job["id"].get<std::string>() + "/events"));
  ASSERT_FALSE(stream.receive_until("event: progress").empty());

  server.signal(SIGTERM);
  EXPECT_NE(stream.receive_until("retry: 2000").find(": the server is shutting down"), std::string::npos);
  EXPECT_TRUE(idle.is_closed());
  EXPECT_EQ(server.wait(), 0);
  EXPECT_NE(server.log().find("draining"), std::string::npos);
}

TEST(Process, ReturnsRunningJobsToTheQueueForTheNextServer) {
  const TemporaryFolder folder;
  const std::vector<std::string> flags = {
      "--data-dir", (folder.path() / "shared").string(), "--workers", "1", "--max-connections", "32", "--max-streams",
      "8"};
  std::string id;
  {
    ServerProcess first(flags);
    id = first.submit(obj_text(icosphere(3)), "sweeps=400")["id"];
    first.wait_for_state(id, "running");
    first.signal(SIGINT);
    EXPECT_EQ(first.wait(), 0);
  }
  ServerProcess second(flags);
  const auto job = second.wait_for_end(id);
  EXPECT_EQ(job["state"], "succeeded");
  EXPECT_EQ(job["attempt"], 1) << "an attempt returned to the queue does not count";
}

TEST(Process, RefusesNewJobsWhileItDrains) {
  ServerProcess server({"--workers", "0", "--max-connections", "32", "--max-streams", "8", "--head-timeout", "10000",
                        "--idle-timeout", "10000"});
  RawConnection late(server.port());
  const std::string request = raw_request("POST", "/v1/jobs?sweeps=1", {{"Content-Type", "model/obj"}}, small_obj());
  late.send(request.substr(0, 40));
  // The drain closes this idle connection, which shows that it has started.
  RawConnection idle(server.port());
  idle.send(raw_request("GET", "/healthz"));
  ASSERT_EQ(idle.receive().status, 200);
  server.signal(SIGTERM);
  ASSERT_TRUE(idle.is_closed());
  late.send(request.substr(40));
  const auto response = late.receive();
  EXPECT_TRUE(response.code() == "shutting_down" || response.status == 0) << response.body;
  EXPECT_EQ(server.wait(), 0);
}

TEST(Process, LogsOneJsonObjectPerLine) {
  ServerProcess server({"--workers", "1", "--log-format", "json", "--max-connections", "32", "--max-streams", "8"});
  server.get("/nowhere%0A%22quoted%22", {{"X-Request-Id", "find-me"}});
  server.wait_for_end(server.submit(small_obj(), kQuick + "&name=%22%0a%ff.obj")["id"]);
  server.signal(SIGTERM);
  ASSERT_EQ(server.wait(), 0);
  std::istringstream lines(server.log());
  std::size_t requests = 0;
  for (std::string line; std::getline(lines, line);) {
    const auto entry = nlohmann::json::parse(line, nullptr, false);
    ASSERT_TRUE(entry.is_object()) << line;
    EXPECT_TRUE(entry.contains("time") && entry.contains("level") && entry.contains("message")) << line;
    if (entry["message"] != "request") continue;
    ++requests;
    for (const std::string field : {"id", "method", "path", "status", "bytes", "ms", "remote"}) {
      EXPECT_TRUE(entry.contains(field)) << field << " of " << line;
    }
    if (entry["id"] == "find-me") {
      EXPECT_EQ(entry["status"], 404);
    }
  }
  EXPECT_GE(requests, 3U);
}

TEST(Process, LogsOneTextLinePerRequest) {
  ServerProcess server({"--workers", "0", "--max-connections", "16", "--max-streams", "4"});
  server.get("/healthz", {{"X-Request-Id", "one-line"}});
  ASSERT_TRUE(eventually([&] { return server.log().find("id=one-line") != std::string::npos; }));
  const std::string log = server.log();
  const std::string line = log.substr(log.rfind('\n', log.find("id=one-line")) + 1);
  EXPECT_NE(line.find("method=GET path=/healthz status=200"), std::string::npos) << line;
}

}  // namespace
}  // namespace crease::test
