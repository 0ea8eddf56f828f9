#include <csignal>

#include "tests/service/service_fixture.h"
#include "tests/support/key_file.h"

namespace crease::test {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> with_keys(const TestKeyFile& file, const std::vector<std::string>& more = {}) {
  std::vector<std::string> flags = {"--workers", "1",      "--max-connections", "64",           "--max-streams",
                                    "32",        "--keys", file.path(),         "--log-format", "json"};
  flags.insert(flags.end(), more.begin(), more.end());
  return flags;
}

/// The text with what follows `name` in it up to the next field replaced.
std::string with_field(std::string link, const std::string& name, const std::string& value) {
  const auto start = link.find(name + "=") + name.size() + 1;
  return link.replace(start, std::min(link.find('&', start), link.size()) - start, value);
}

class Links : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    alice_ = make_test_key("alice");
    bob_ = make_test_key("bob");
    file_ = std::make_unique<TestKeyFile>(std::vector<TestKey>{alice_, bob_});
    server_ = std::make_unique<ServerProcess>(with_keys(*file_));
  }
  static void TearDownTestSuite() {
    server_.reset();
    file_.reset();
  }

  static RawResponse call(const std::string& method, const std::string& target, const Headers& headers = {}) {
    return exchange(server_->port(), method, target, headers);
  }
  static std::string submit() {
    const auto job = server_->submit(small_obj(), kQuick, alice_.bearer());
    const std::string path = "/v1/jobs/" + job["id"].get<std::string>();
    EXPECT_TRUE(eventually([&] { return call("GET", path, alice_.bearer()).json()["state"] == "succeeded"; }));
    return path;
  }
  static std::string link(const std::string& path, const std::string& query) {
    const auto made = call("POST", path + "/links?" + query, alice_.bearer());
    EXPECT_EQ(made.status, 201) << made.body;
    return made.json().value("url", "");
  }

  static inline TestKey alice_, bob_;
  static inline std::unique_ptr<TestKeyFile> file_;
  static inline std::unique_ptr<ServerProcess> server_;
};

TEST_F(Links, ReadWhatTheyNameWithoutAKey) {
  const std::string job = submit();
  EXPECT_EQ(call("GET", job + "/mesh.glb").status, 401);
  for (const std::string query : {"result=mesh&format=obj", "result=mesh&format=glb&measured=true",
                                  "result=labels&format=csv&min=0.5", "result=ridges", "result=report&format=json"}) {
    const std::string address = link(job, query);
    EXPECT_TRUE(address.starts_with(job + "/")) << address;
    const auto read = call("GET", address);
    ASSERT_EQ(read.status, 200) << address << read.body;
    const std::string unsigned_address = address.substr(0, address.find('?'));
    const std::string fields = query.find("measured") != std::string::npos ? "?measured=true"
                               : query.find("min") != std::string::npos    ? "?min=0.5"
                                                                           : "";
    EXPECT_EQ(read.body, call("GET", unsigned_address + fields, alice_.bearer()).body) << query;
  }
  const std::string mesh = link(job, "result=mesh&format=obj");
  EXPECT_EQ(call("GET", mesh, {{"Range", "bytes=0-9"}}).status, 206);
  EXPECT_EQ(call("HEAD", mesh).status, 200);
  EXPECT_EQ(call("GET", link(job, "result=job")).json()["state"], "succeeded");
  EXPECT_NE(call("GET", link(job, "result=events")).body.find("event: succeeded"), std::string::npos);
}

TEST_F(Links, ReadNothingElse) {
  const std::string job = submit(), other = submit();
  const std::string mesh = link(job, "result=mesh&format=obj"), self = link(job, "result=job");
  const auto field = [&](const std::string& name) {
    const auto start = mesh.find(name + "=") + name.size() + 1;
    return mesh.substr(start, std::min(mesh.find('&', start), mesh.size()) - start);
  };
  std::string signature = field("signature");
  signature[7] = signature[7] == '0' ? '1' : '0';
  const std::string query = mesh.substr(mesh.find('?'));
  for (const std::string& changed :
       {with_field(mesh, "signature", signature), with_field(mesh, "signature", ""),
        with_field(mesh, "expires", std::to_string(std::stoll(field("expires")) + 60)),
        with_field(mesh, "key", bob_.id()), mesh + "&measured=true", job + "/mesh.ply" + query,
        job + "/mesh" + query + "&format=obj", job + "/labels.csv" + query, job + query, other + "/mesh.obj" + query}) {
    EXPECT_EQ(call("GET", changed).code(), "link_invalid") << changed;
    EXPECT_EQ(call("GET", changed, alice_.bearer()).code(), "link_invalid") << "a key does not mend a link";
  }
  EXPECT_EQ(call("DELETE", self).status, 401);
  EXPECT_EQ(call("POST", job + "/cancel" + query).status, 401);
  EXPECT_EQ(call("GET", "/v1/jobs" + query).status, 401);
  EXPECT_EQ(call("GET", mesh).status, 200);
}

TEST_F(Links, Expire) {
  const std::string address = link(submit(), "result=mesh&expires_in=1");
  EXPECT_TRUE(eventually([&] { return call("GET", address).code() == "link_expired"; }));
  EXPECT_EQ(call("GET", address).status, 410);
}

TEST_F(Links, EndWithTheJob) {
  const std::string job = submit(), address = link(job, "result=ridges&format=json");
  EXPECT_EQ(call("GET", address).status, 200);
  EXPECT_EQ(call("DELETE", job, alice_.bearer()).status, 204);
  EXPECT_EQ(call("GET", address).code(), "job_not_found");
}

TEST_F(Links, AreForOwnersAndForPartsThatThereAre) {
  const std::string job = submit();
  const auto code = [&](const std::string& query, const TestKey& key) {
    return call("POST", job + "/links?" + query, key.bearer()).code();
  };
  EXPECT_EQ(code("result=mesh", bob_), "job_not_found");
  EXPECT_EQ(call("POST", job + "/links?result=mesh").code(), "unauthorized");
  for (const std::string query : {"format=obj", "result=upload", "result=mesh&format=csv", "result=job&format=json",
                                  "result=mesh&measured=yes"}) {
    EXPECT_TRUE(code(query, alice_).starts_with("parameter_")) << query;
  }
  EXPECT_EQ(code("result=labels&measured=true", alice_), "parameter_unknown");
  EXPECT_EQ(code("result=mesh&expires_in=0", alice_), "parameter_out_of_range");
  EXPECT_EQ(exchange(server_->port(), "POST", job + "/links?result=mesh", alice_.bearer(), "{}").code(),
            "request_malformed");
}

TEST_F(Links, AreNotInTheLog) {
  const std::string address = link(submit(), "result=mesh&format=stl");
  const std::string signature = address.substr(address.find("signature=") + 10);
  std::string disguised = address;
  disguised.replace(disguised.find("signature="), 1, "%73");
  EXPECT_EQ(call("GET", address).status, 200);
  EXPECT_EQ(call("GET", disguised).status, 200);
  call("GET", "/v1/parameters", {{"X-Request-Id", "after-the-links"}});
  ASSERT_TRUE(eventually([] { return server_->log().find("after-the-links") != std::string::npos; }));
  EXPECT_NE(server_->log().find("/mesh.stl?..."), std::string::npos);
  EXPECT_EQ(server_->log().find(signature), std::string::npos);
}

TEST(LinksOfKeys, EndWithTheirKeyAndOutliveARestart) {
  const TestKey first = make_test_key("first"), second = make_test_key("second");
  const TestKeyFile file({first, second});
  const TemporaryFolder folder;
  const std::vector<std::string> flags = with_keys(file, {"--data-dir", (folder.path() / "data").string()});
  std::string address, id;
  {
    const ServerProcess server(flags);
    id = server.submit(small_obj(), kQuick, first.bearer())["id"];
    const auto made = exchange(server.port(), "POST", "/v1/jobs/" + id + "/links?result=job", first.bearer());
    address = made.json()["url"];
  }
  const auto permissions = fs::status(folder.path() / "data" / "link-secret").permissions();
  EXPECT_EQ(permissions & (fs::perms::group_all | fs::perms::others_all), fs::perms::none);
  const ServerProcess server(flags);
  EXPECT_EQ(server.get(address).status, 200);
  file.write({second});
  server.signal(SIGHUP);
  EXPECT_TRUE(eventually([&] { return server.get(address).code() == "link_invalid"; }));
}

}  // namespace
}  // namespace crease::test
