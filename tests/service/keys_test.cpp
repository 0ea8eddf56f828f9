#include <csignal>
#include <fstream>
#include <set>

#include "server/api/routes.h"
#include "tests/service/service_fixture.h"
#include "tests/support/key_file.h"

namespace crease::test {
namespace {

namespace fs = std::filesystem;

/// A service with two keys whose callers must not see each other's jobs.
class Keys : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    alice_ = make_test_key("alice");
    bob_ = make_test_key("bob");
    operator_ = make_test_key("operator", {{"metrics", true}});
    file_ = std::make_unique<TestKeyFile>(std::vector<TestKey>{alice_, bob_, operator_});
    server_ = std::make_unique<ServerProcess>(std::vector<std::string>{"--workers", "1", "--max-connections", "64",
                                                                       "--max-streams", "32", "--keys", file_->path(),
                                                                       "--key-rate", "0"});
  }
  static void TearDownTestSuite() {
    server_.reset();
    file_.reset();
  }
  static RawResponse call(const std::string& method, const std::string& target, const Headers& headers = {},
                          const std::string& body = {}) {
    return exchange(server_->port(), method, target, headers, body);
  }
  static nlohmann::json submit(const TestKey& key, const Headers& more = {}, const std::string& query = kQuick) {
    Headers headers = key.with({{"Content-Type", "model/obj"}});
    headers.insert(headers.end(), more.begin(), more.end());
    const auto response = call("POST", "/v1/jobs?" + query, headers, small_obj());
    EXPECT_EQ(response.status, 202) << response.body;
    return response.json();
  }
  static std::string finished(const TestKey& key, const std::string& query = kQuick) {
    std::string self = "/v1/jobs/" + submit(key, {}, query)["id"].get<std::string>();
    const auto events = parse_events(call("GET", self + "/events", key.bearer()).body);
    EXPECT_EQ(events.back().type, "succeeded");
    return self;
  }
  static std::set<std::string> listed(const TestKey& key) {
    std::set<std::string> ids;
    const auto page = call("GET", "/v1/jobs?limit=1000", key.bearer()).json();
    for (const auto& job : page["jobs"]) ids.insert(job["id"]);
    return ids;
  }

  static inline TestKey alice_, bob_, operator_;
  static inline std::unique_ptr<TestKeyFile> file_;
  static inline std::unique_ptr<ServerProcess> server_;
};

TEST_F(Keys, AreNeededForEveryCallExceptTheOpenOnes) {
  const std::set<std::string> open = {"get_health",  "get_readiness", "get_openapi",
                                      "get_metrics", "get_page",      "get_docs"};
  for (const auto& route : creased::routes()) {
    SCOPED_TRACE(route.operation);
    if (route.operation == "get_asset") continue;  // open as well, but there are none of a fixed name
    std::string path = route.path;
    if (const auto brace = path.find("{id}"); brace != std::string::npos) path.replace(brace, 4, "nope");
    for (const Headers& headers : {Headers{}, Headers{{"Authorization", "Bearer crk_nobody_nothing"}}}) {
      const auto response = call(route.method, path, headers);
      if (open.contains(route.operation)) {
        EXPECT_EQ(response.status, 200);
        continue;
      }
      EXPECT_EQ(response.status, 401);
      EXPECT_EQ(response.code(), "unauthorized");
      EXPECT_TRUE(response.header("www-authenticate").starts_with("Bearer")) << response.header("www-authenticate");
    }
  }
  EXPECT_EQ(call("GET", "/nowhere").status, 401);
  EXPECT_EQ(call("GET", "/v1/%6aobs").status, 401);
  EXPECT_EQ(call("GET", "http://localhost/v1/jobs").status, 401);
  EXPECT_EQ(call("GET", "/nowhere", alice_.bearer()).status, 404);
  EXPECT_EQ(call("GET", "/v1/jobs", alice_.bearer()).status, 200);
}

TEST_F(Keys, AreReadAsTheStandardSays) {
  EXPECT_EQ(call("GET", "/v1/jobs", {{"Authorization", "bearer " + alice_.text}}).status, 200);
  EXPECT_EQ(call("GET", "/v1/jobs", {{"authorization", "BEARER " + alice_.text}}).status, 200);
  for (const std::string& wrong :
       {std::string("Bearer"), "Bearer  " + alice_.text, "Basic " + alice_.text, alice_.text, "Bearer " + alice_.id(),
        "Bearer " + alice_.text + "0", "Bearer " + alice_.text + " x", std::string("Bearer \xff\xfe")}) {
    EXPECT_EQ(call("GET", "/v1/jobs", {{"Authorization", wrong}}).status, 401) << wrong;
  }
  EXPECT_EQ(call("GET", "/v1/jobs?key=" + alice_.text).status, 401) << "a key in a query ends up in logs";
  const Headers two = alice_.with({{"Authorization", "Bearer " + bob_.text}});
  EXPECT_EQ(call("GET", "/v1/jobs", two).code(), "request_malformed");
}

TEST_F(Keys, ThatAreInvalidAllGetTheSameAnswer) {
  const auto answer = [&](const std::string& key) {
    auto response = call("GET", "/v1/jobs", {{"Authorization", "Bearer " + key}, {"X-Request-Id", "same"}});
    response.headers.erase("date");
    return std::pair(response.headers, response.body);
  };
  const auto of_unknown_id = answer("crk_0000000000000000_" + std::string(64, '0'));
  EXPECT_EQ(answer("crk_" + alice_.id() + "_" + std::string(64, '0')), of_unknown_id);
  EXPECT_EQ(answer("nonsense"), of_unknown_id);
}

TEST_F(Keys, AreCheckedBeforeTheBodyIsSent) {
  RawConnection patient(server_->port());
  patient.send("POST /v1/jobs HTTP/1.1\r\nHost: x\r\nContent-Length: 1000000\r\nExpect: 100-continue\r\n\r\n");
  EXPECT_EQ(patient.receive().status, 401) << "not 100, as the body is not needed";

  RawConnection hasty(server_->port());
  hasty.send("POST /v1/jobs HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n");
  const auto response = hasty.receive();
  EXPECT_EQ(response.status, 401);
  EXPECT_EQ(response.header("connection"), "close");

  RawConnection right(server_->port());
  right.send(
      "POST /v1/jobs HTTP/1.1\r\nHost: x\r\nContent-Type: model/obj\r\nContent-Length: 5\r\nExpect: "
      "100-continue\r\nAuthorization: Bearer " +
      alice_.text + "\r\n\r\n");
  EXPECT_EQ(right.receive().status, 100);
}

TEST_F(Keys, SeeOnlyTheirOwnJobs) {
  const std::string job = finished(alice_), id = job.substr(job.rfind('/') + 1);
  EXPECT_TRUE(listed(alice_).contains(id));
  EXPECT_FALSE(listed(bob_).contains(id));
  EXPECT_FALSE(listed(operator_).contains(id));
  for (const auto& route : creased::routes()) {
    if (route.path.find("{id}") == std::string::npos) continue;
    SCOPED_TRACE(route.operation);
    if (route.operation == "get_asset") continue;  // open as well, but there are none of a fixed name
    std::string path = route.path;
    path.replace(path.find("{id}"), 4, id);
    std::string missing = route.path;
    missing.replace(missing.find("{id}"), 4, std::string(id.size(), '0'));
    if (route.operation == "create_link") {
      for (std::string* target : {&path, &missing}) *target += "?result=mesh";
    }
    const auto other = call(route.method, path, bob_.bearer());
    EXPECT_EQ(other.status, 404);
    EXPECT_EQ(other.code(), "job_not_found");
    EXPECT_EQ(call(route.method, missing, bob_.bearer()).code(), "job_not_found");
  }
  for (const std::string query :
       {"/mesh?format=obj", "/mesh?snapshot=true", "/labels?format=csv", "/ridges?format=glb"}) {
    EXPECT_EQ(call("GET", job + query, bob_.bearer()).code(), "job_not_found");
    EXPECT_NE(call("GET", job + query, alice_.bearer()).status, 404);
  }
  EXPECT_EQ(call("GET", job, alice_.bearer()).json()["state"], "succeeded") << "another key cancelled or deleted it";
}

TEST_F(Keys, CannotTellFromIdsThatOthersSentTheSameMesh) {
  const std::string query = "sweeps=2&seed=77";  // used by no other test here
  const std::string of_alice = finished(alice_, query), of_bob = finished(bob_, query);
  EXPECT_NE(of_alice, of_bob);
  EXPECT_EQ(of_alice.size(), of_bob.size()) << "a suffix would reveal that the id was taken";
  const auto mesh = call("GET", of_alice + "/mesh", alice_.bearer());
  ASSERT_EQ(mesh.status, 200);
  EXPECT_TRUE(mesh.body == call("GET", of_bob + "/mesh", bob_.bearer()).body) << "the same bytes for everyone";
  call("DELETE", of_alice, alice_.bearer());
  call("DELETE", of_bob, bob_.bearer());
}

TEST_F(Keys, HaveTheirOwnIdempotencyKeys) {
  const Headers once = {{"Idempotency-Key", "the-first"}};
  const auto first = submit(alice_, once);
  EXPECT_EQ(submit(alice_, once)["id"], first["id"]);
  EXPECT_NE(submit(bob_, once)["id"], first["id"]);
}

TEST_F(Keys, CannotUseTheCursorsOfOthersToSeeTheirJobs) {
  finished(alice_);
  finished(alice_);
  const auto page = call("GET", "/v1/jobs?limit=1", alice_.bearer()).json();
  const auto others =
      call("GET", "/v1/jobs?limit=1000&cursor=" + page["next_cursor"].get<std::string>(), bob_.bearer()).json();
  const auto own = listed(bob_);
  for (const auto& job : others["jobs"]) EXPECT_TRUE(own.contains(job["id"]));
}

TEST_F(Keys, ReadMetricsOnlyWhenAllowed) {
  const Headers far = {{"X-Forwarded-For", "203.0.113.1"}};
  EXPECT_EQ(call("GET", "/metrics").status, 200) << "this machine";
  EXPECT_EQ(call("GET", "/metrics", far).status, 401);
  EXPECT_EQ(call("GET", "/metrics", {{"Forwarded", "for=203.0.113.1"}}).status, 401);
  EXPECT_EQ(call("GET", "/metrics", alice_.with(far)).code(), "forbidden");
  EXPECT_EQ(call("GET", "/metrics", operator_.with(far)).status, 200);
}

TEST_F(Keys, AreNeverLogged) {
  call("GET", "/v1/jobs", alice_.bearer());
  call("GET", "/v1/jobs?key=" + alice_.text + "&auth=Bearer%20" + bob_.text);
  // Of the refusals of strangers, which others of these tests bring by the dozen, the log keeps only some.
  call("GET", "/" + bob_.text, alice_.with({{"X-Request-Id", "a-key-in-the-path"}}));
  ASSERT_TRUE(eventually([] { return server_->log().find("a-key-in-the-path") != std::string::npos; }));
  const std::string log = server_->log();
  for (const auto& key : {alice_, bob_, operator_}) {
    EXPECT_EQ(log.find(key.text), std::string::npos);
    EXPECT_EQ(log.find(key.text.substr(key.text.rfind('_') + 1)), std::string::npos);
    EXPECT_EQ(log.find(key.entry["sha256"].get<std::string>()), std::string::npos);
  }
  EXPECT_NE(log.find("key=" + alice_.id()), std::string::npos) << "the log names the key's id";
}

TEST_F(Keys, WorkWithTheCommandLine) {
  const TemporaryFolder folder;
  const std::string file = (folder.path() / "key").string(), empty = (folder.path() / "empty").string();
  std::ofstream(file) << alice_.text << "\n";
  std::ofstream(empty) << "\n";
  const std::string url = "http://127.0.0.1:" + std::to_string(server_->port());
  const auto crease = [&](const std::string& before, const std::string& after) {
    return run_program({"/bin/sh", "-c", before + " exec " CREASE_BIN " list --server " + url + " " + after});
  };
  for (const auto& [before, after] :
       std::vector<std::pair<std::string, std::string>>{{"", "--key " + alice_.text},
                                                        {"", "--key-file " + file},
                                                        {"CREASED_KEY=" + alice_.text, ""},
                                                        {"CREASED_KEY=wrong", "--key-file " + file},
                                                        {"CREASED_KEY=wrong", "--key " + alice_.text}}) {
    const Finished listed = crease(before, after);
    EXPECT_EQ(listed.exit_code, 0) << before << " " << after << listed.errors;
  }
  const Finished without = crease("", "");
  EXPECT_EQ(without.exit_code, 10);
  EXPECT_NE(without.errors.find("unauthorized"), std::string::npos) << without.errors;
  EXPECT_EQ(crease("CREASED_KEY=wrong", "").exit_code, 10);
  EXPECT_EQ(crease("", "--key-file " + empty).exit_code, 2);
  EXPECT_EQ(crease("", "--key-file /nowhere").exit_code, 9);
  EXPECT_EQ(crease("", "--key-file " + file + " --key x").exit_code, 2);
}

TEST(KeyReload, TakesEffectWithoutDroppingConnections) {
  const TestKey first = make_test_key("first"), second = make_test_key("second");
  const TestKeyFile file({first});
  ServerProcess server({"--workers", "0", "--max-connections", "16", "--max-streams", "4", "--keys", file.path()});
  RawConnection kept(server.port());
  const auto status = [&](const TestKey& key) {
    kept.send(raw_request("GET", "/v1/jobs", key.bearer()));
    return kept.receive().status;
  };
  const auto reloads = [&](const std::string& text) {
    std::size_t count = 0;
    const std::string log = server.log();
    for (auto at = log.find(text); at != std::string::npos; at = log.find(text, at + 1)) ++count;
    return count;
  };
  EXPECT_EQ(status(first), 200);
  EXPECT_EQ(status(second), 401);

  file.write({first, second});
  server.signal(SIGHUP);
  ASSERT_TRUE(eventually([&] { return status(second) == 200; }));
  EXPECT_EQ(status(first), 200);

  file.write_text("{\"keys\": [");
  server.signal(SIGHUP);
  ASSERT_TRUE(eventually([&] { return reloads("keys not reloaded") == 1; })) << server.log();
  EXPECT_EQ(status(first), 200);
  EXPECT_EQ(status(second), 200);

  file.write({second});
  server.signal(SIGHUP);
  ASSERT_TRUE(eventually([&] { return status(first) == 401; }));
  EXPECT_EQ(status(second), 200);
  kept.send(raw_request("GET", "/healthz"));
  EXPECT_EQ(kept.receive().status, 200);
}

TEST(KeyReload, WithoutKeysTheSignalEndsTheService) {
  ServerProcess server({"--workers", "0", "--max-connections", "16", "--max-streams", "4"});
  server.signal(SIGHUP);
  EXPECT_EQ(server.wait(), 0);
}

Finished serve(const std::vector<std::string>& flags) {
  const TemporaryFolder folder;
  std::vector<std::string> command = {CREASED_BIN, "serve", "--port",     "0",
                                      "--workers", "0",     "--data-dir", (folder.path() / "data").string()};
  command.insert(command.end(), flags.begin(), flags.end());
  return run_program(command);
}

TEST(KeyConfiguration, IsRefusedWhenItIsContradictory) {
  const TestKeyFile file({make_test_key("alice")});
  const std::vector<std::vector<std::string>> refused = {{"--keys", file.path(), "--open"},
                                                         {"--host", "0.0.0.0"},
                                                         {"--cors-origin", "*"},
                                                         {"--cors-origin", "https://example.org/"},
                                                         {"--cors-origin", "example.org"},
                                                         {"--cors-origin", "null"},
                                                         {"--keys", file.path(), "--cors-origin", "*"},
                                                         {"--trusted-proxy", "proxy.example.org"},
                                                         {"--trusted-proxy", "10.0.0.0/64"},
                                                         {"--key-burst", "0"}};
  for (const auto& flags : refused) {
    const Finished finished = serve(flags);
    EXPECT_EQ(finished.exit_code, 2) << flags.front() << " " << flags.back() << finished.errors;
  }
}

TEST(KeyConfiguration, AnInvalidFileKeepsTheServiceFromStarting) {
  TestKey key = make_test_key("alice");
  key.entry["max_quued"] = 5;
  const TestKeyFile file({key});
  const Finished unknown = serve({"--keys", file.path()});
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_NE(unknown.errors.find("max_quued"), std::string::npos) << unknown.errors;
  EXPECT_EQ(serve({"--keys", "/nowhere/keys.json"}).exit_code, 1);
  key.entry.erase("max_quued");
  file.write({key});
  fs::permissions(file.path(), fs::perms::others_write, fs::perm_options::add);
  const Finished writable = serve({"--keys", file.path()});
  EXPECT_EQ(writable.exit_code, 1);
  EXPECT_NE(writable.errors.find("can write the file"), std::string::npos) << writable.errors;
}

TEST(KeyConfiguration, WarnsAboutAFileThatOthersCanRead) {
  const TestKeyFile file({make_test_key("alice")});
  fs::permissions(file.path(), fs::perms::others_read, fs::perm_options::add);
  ServerProcess server(
      {"--host", "0.0.0.0", "--workers", "0", "--max-connections", "16", "--max-streams", "4", "--keys", file.path()});
  EXPECT_TRUE(eventually([&] { return server.log().find("can be read by other users") != std::string::npos; }));
  EXPECT_EQ(server.get("/v1/jobs").status, 401);
}

TEST(KeyCommand, AddsToAFileAndPrintsTheKeyOnce) {
  const TemporaryFolder folder;
  const std::string file = (folder.path() / "keys.json").string();
  const Finished first = run_program({CREASED_BIN, "key", "alice", "--keys", file});
  ASSERT_EQ(first.exit_code, 0) << first.errors;
  const Finished second = run_program({CREASED_BIN, "key", "bob", "--keys", file});
  ASSERT_EQ(second.exit_code, 0) << second.errors;
  const std::string key = first.output.substr(0, first.output.find('\n'));
  EXPECT_EQ(read_file(file).find(key.substr(key.rfind('_') + 1)), std::string::npos);
  ServerProcess server({"--workers", "0", "--max-connections", "16", "--max-streams", "4", "--keys", file});
  EXPECT_EQ(server.get("/v1/jobs", {{"Authorization", "Bearer " + key}}).status, 200);
  EXPECT_EQ(run_program({CREASED_BIN, "key", ""}).exit_code, 2);
  EXPECT_EQ(run_program({CREASED_BIN, "key"}).exit_code, 2);
  EXPECT_EQ(run_program({CREASED_BIN, "key", "carol", "--keys", "/nowhere/keys.json"}).exit_code, 1);
}

}  // namespace
}  // namespace crease::test
