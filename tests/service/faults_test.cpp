#include <gmock/gmock.h>

#include <csignal>
#include <fstream>

#include "tests/service/service_fixture.h"
#include "tests/support/key_file.h"

namespace crease::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

const std::string kFast = "sweeps=3&threads=1&solver=metropolis";

std::vector<std::string> little(const std::string& workers, const std::vector<std::string>& more) {
  std::vector<std::string> flags = {"--workers", workers, "--max-connections", "32", "--max-streams", "8"};
  flags.insert(flags.end(), more.begin(), more.end());
  return flags;
}

void flip_a_bit(const fs::path& path) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  const auto middle = static_cast<std::streamoff>(fs::file_size(path) / 2);
  file.seekg(middle);
  const int byte = file.get();
  file.seekp(middle);
  file.put(static_cast<char>(byte ^ 1));
}

class Faults : public ::testing::Test {
 protected:
  fs::path file_of(const std::string& id, const std::string& name) const {
    return server_->data_dir() / "jobs" / id / name;
  }
  std::string submit(const std::string& query = kFast) {
    return server_->submit(obj_text(cube(4)), query)["id"].get<std::string>();
  }
  RawResponse get(const std::string& id, const std::string& what) { return server_->get("/v1/jobs/" + id + what); }
  void start(const std::string& workers, const std::vector<std::string>& more = {}) {
    server_ = std::make_unique<ServerProcess>(little(workers, more));
  }

  std::unique_ptr<ServerProcess> server_;
};

TEST_F(Faults, AnUploadOfManyUnusedVerticesIsAJobLikeOthers) {
  start("1", {"--checkpoint-every", "0"});
  std::string obj = obj_text(cube(1));
  for (int i = 0; i < 120'000; ++i) obj += fmt::format("v {} 1 0\n", i % 100);
  const std::string id = server_->submit(obj, kFast)["id"];
  const std::string after = submit();
  EXPECT_EQ(server_->wait_for_state(after, "succeeded")["state"], "succeeded");
  const auto job = server_->wait_for_state(id, "succeeded");
  EXPECT_EQ(job["state"], "succeeded") << job;
  EXPECT_EQ(job["attempt"], 1);
}

TEST_F(Faults, AJobWhoseUploadIsGoneOrAnotherEndsAndLeavesTheQueue) {
  start("0");
  const std::string gone = submit("sweeps=3&seed=1"), other = submit("sweeps=3&seed=2"),
                    folder = submit("sweeps=3&seed=3");
  const std::string sound = submit("sweeps=3&seed=4");
  fs::remove(file_of(gone, "upload"));
  std::ofstream(file_of(other, "upload")) << obj_text(cube(5));
  fs::remove(file_of(folder, "upload"));
  fs::create_directory(file_of(folder, "upload"));
  const Program worker({CREASED_BIN, "worker", "--data-dir", server_->data_dir().string()});
  EXPECT_EQ(server_->wait_for_state(sound, "succeeded")["state"], "succeeded");
  for (const std::string& id : {gone, other, folder}) {
    const auto job = server_->wait_for_state(id, "failed");
    EXPECT_EQ(job["state"], "failed");
    EXPECT_EQ(job["error"]["code"], "upload_damaged") << job;
  }
}

TEST_F(Faults, ADamagedResultIsNeverServedAndADamagedDownloadIsMadeAgain) {
  start("1");
  const std::string id = submit();
  server_->wait_for_state(id, "succeeded");
  const std::string mesh = get(id, "/mesh?format=ply").body, labels = get(id, "/labels").body;
  flip_a_bit(file_of(id, "mesh.ply"));
  fs::resize_file(file_of(id, "labels.json"), labels.size() / 2);
  EXPECT_TRUE(get(id, "/mesh?format=ply").body == mesh);
  EXPECT_EQ(get(id, "/labels").body, labels);
  flip_a_bit(file_of(id, "result.pb"));
  EXPECT_EQ(get(id, "/mesh?format=obj").code(), "result_damaged");
  EXPECT_EQ(get(id, "/labels?min=0.5").code(), "result_damaged");
  fs::resize_file(file_of(id, "result.pb"), 0);
  EXPECT_EQ(get(id, "/mesh?format=obj").code(), "result_damaged");
  flip_a_bit(file_of(id, "report.pb"));
  EXPECT_EQ(get(id, "/report").code(), "result_damaged");
  EXPECT_TRUE(get(id, "/mesh?format=ply").body == mesh) << "what was made before is sound";
  EXPECT_EQ(get(id, "").status, 200);
}

TEST_F(Faults, ARevokedKeyLosesItsStreamsAndItsJobs) {
  const TestKey key = make_test_key("anna");
  const TestKeyFile keys({key});
  start("0", {"--keys", keys.path()});
  const auto job = server_->submit(obj_text(cube(4)), kFast, key.bearer());
  RawConnection stream(server_->port());
  stream.send(raw_request("GET", "/v1/jobs/" + job["id"].get<std::string>() + "/events", key.bearer()));
  ASSERT_FALSE(stream.receive_until("retry: ").empty());
  keys.write({make_test_key("bert")});
  server_->signal(SIGHUP);
  EXPECT_THAT(stream.receive_until("revoked"), HasSubstr(": the key was revoked"));
}

TEST(Configuration, WhatAFileSaysAndMeansNothingIsRefusedByName) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "creased.toml";
  const auto started = [&](const std::string& text) {
    std::ofstream(file) << text;
    return run_program({CREASED_BIN, "serve", "--config", file.string(), "--port", "0", "--data-dir", "/proc/none"});
  };
  for (const auto& [text, name] :
       std::vector<std::pair<std::string, std::string>>{{"[serve]\nkey = \"keys.json\"\n", "'key'"},
                                                        {"[server]\nworkers = 1\n", "[server]"},
                                                        {"workers = 1\n", "'workers'"},
                                                        {"serve:\n  keys: keys.json\n", "line 1"},
                                                        {"[serve]\nworkers: 2\n", "line 2"},
                                                        {"[serve]\nworkers = 1\nworkers = 2\n", "--workers"},
                                                        {"[serve]\nworkers = \"many\"\n", "many"}}) {
    const auto run = started(text);
    EXPECT_EQ(run.exit_code, 2) << text;
    EXPECT_THAT(run.errors + run.output, HasSubstr(name)) << text;
  }
}

TEST(Configuration, AFlagGoesBeforeTheEnvironmentAndTheEnvironmentBeforeTheFile) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "creased.toml";
  std::ofstream(file) << "[serve]\nmax-upload-mb = 1\nworkers = 0\nmax-connections = 16\nmax-streams = 4\n";
  ::setenv("CREASED_MAX_UPLOAD_MB", "4", 1);
  const auto status = [&](const std::vector<std::string>& flags) {
    std::vector<std::string> all = {"--config", file.string()};
    all.insert(all.end(), flags.begin(), flags.end());
    const ServerProcess server(all);
    return exchange(server.port(), "POST", "/v1/jobs", {}, std::string(2'000'000, ' ')).code();
  };
  const std::string by_environment = status({}), by_flag = status({"--max-upload-mb", "1"});
  ::unsetenv("CREASED_MAX_UPLOAD_MB");
  EXPECT_NE(by_environment, "payload_too_large");
  EXPECT_EQ(by_flag, "payload_too_large");
}

TEST(Start, WithTooFewFilesToOpenSaysWhatIsMissing) {
  const TemporaryFolder folder;
  const auto run = run_program({"/bin/sh", "-c",
                                fmt::format("ulimit -n 200; exec {} serve --port 0 --data-dir {}", CREASED_BIN,
                                            (folder.path() / "data").string())});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.errors, HasSubstr("--max-connections"));
}

class OddRequests : public ServiceTest {};

TEST_F(OddRequests, AreRefused) {
  const std::string chunked = "POST /v1/jobs HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n";
  for (const std::string& request :
       {chunked + "1;a=\nb\r\nx\r\n0\r\n\r\n", chunked + "1;a=\rb\r\nx\r\n0\r\n\r\n",
        chunked + "1;a=" + std::string(1, '\0') + "\r\nx\r\n0\r\n\r\n", chunked + " 1\r\nx\r\n0\r\n\r\n",
        chunked + "1 \r\nx\r\n0\r\n\r\n", std::string("GET http://?a=/healthz HTTP/1.1\r\nHost: x\r\n\r\n"),
        std::string("GET http://u@x/healthz HTTP/1.1\r\nHost: x\r\n\r\n"),
        std::string("GET /healthz HTTP/1.1\r\nHost: x y\r\n\r\n"),
        std::string("GET /healthz HTTP/1.1\r\nHost: x,y\r\n\r\n")}) {
    RawConnection connection(server().port());
    connection.send(request);
    EXPECT_EQ(connection.receive().status, 400) << request;
  }
}

TEST_F(OddRequests, AreReadAsTheyAreMeant) {
  const auto status = [&](const std::string& target) {
    RawConnection connection(server().port());
    connection.send("GET " + target + " HTTP/1.1\r\nHost: x\r\n\r\n");
    return connection.receive().status;
  };
  EXPECT_EQ(status("HTTP://x/healthz"), 200);
  EXPECT_EQ(status("http://x?a=/healthz"), 400) << "the path is /, the page, which has no parameter a";
  EXPECT_EQ(status("/%u0068ealthz"), 404);
  EXPECT_EQ(status("/%68ealthz"), 200);

  RawConnection closing(server().port());
  closing.send("GET /healthz HTTP/1.1\r\nHost: x\r\nConnection: keep-alive\r\nConnection: close\r\n\r\n");
  EXPECT_EQ(closing.receive().header("connection"), "close");

  RawConnection split(server().port());
  split.send("\r");
  split.send("\n\r\nGET /healthz HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_EQ(split.receive().status, 200);
}

}  // namespace
}  // namespace crease::test
