#include <fstream>

#include "server/transport/http_head.h"
#include "tests/service/service_fixture.h"

namespace crease::test {
namespace {

const std::vector<std::string> kFew = {"--workers", "1", "--max-connections", "16", "--max-streams", "4"};

std::vector<std::string> few_and(const std::vector<std::string>& more) {
  std::vector<std::string> flags = kFew;
  flags.insert(flags.end(), more.begin(), more.end());
  return flags;
}

TEST(BasePath, IsBeforeEveryLinkAndMayBeBeforeEveryPath) {
  const ServerProcess server(few_and({"--base-path", "/meshes"}));
  const auto submitted =
      exchange(server.port(), "POST", "/meshes/v1/jobs?" + kQuick, {{"Content-Type", "model/obj"}}, small_obj());
  ASSERT_EQ(submitted.status, 202) << submitted.body;
  const std::string self = "/meshes/v1/jobs/" + submitted.json()["id"].get<std::string>();
  EXPECT_EQ(submitted.header("location"), self);
  for (const auto& [name, link] : submitted.json()["links"].items()) {
    EXPECT_TRUE(link.get<std::string>().starts_with(self)) << name;
  }
  EXPECT_EQ(server.wait_for_end(submitted.json()["id"])["state"], "succeeded") << "and without it";
  EXPECT_EQ(server.get("/meshes/v1/jobs").json()["jobs"][0]["links"]["self"], self);
  EXPECT_EQ(server.get(self + "/mesh.obj").status, 200);
  const auto link = exchange(server.port(), "POST", self + "/links?result=mesh&format=stl").json()["url"];
  EXPECT_TRUE(link.get<std::string>().starts_with(self + "/mesh.stl?")) << link;
  EXPECT_EQ(server.get(link).status, 200);
  EXPECT_EQ(server.get("/meshes/openapi.json").json()["servers"][0]["url"], "/meshes");
  EXPECT_EQ(server.get("/healthz").status, 200);
  EXPECT_EQ(server.get("/meshesv1/jobs").status, 404);
}

TEST(BasePath, GetsItsSlashSoThatThePageFindsItsFiles) {
  const ServerProcess server(few_and({"--base-path", "/meshes"}));
  const auto moved = server.get("/meshes");
  EXPECT_EQ(moved.status, 308);
  EXPECT_EQ(moved.header("location"), "/meshes/");
  EXPECT_EQ(server.get("/meshes/").status, 200);
}

TEST(BasePath, IsTakenFromTrustedProxiesOnly) {
  const ServerProcess trusting(few_and({"--trusted-proxy", "127.0.0.1"})), other(kFew);
  const Headers header = {{"X-Forwarded-Prefix", "/a/b/"}};
  EXPECT_EQ(trusting.get("/openapi.json", header).json()["servers"][0]["url"], "/a/b");
  EXPECT_EQ(other.get("/openapi.json", header).json()["servers"][0]["url"], "/");
  for (const std::string prefix : {"//evil.example", "evil", "/a/../b", "/a b", "/a?b", "https://evil.example/"}) {
    EXPECT_EQ(trusting.get("/v1/parameters", {{"X-Forwarded-Prefix", prefix}}).code(), "request_malformed") << prefix;
  }
}

TEST(BasePath, MustBeAPath) {
  for (const std::string path : {"meshes", "/meshes/", "/", "//meshes", "/a/./b", "/m eshes"}) {
    EXPECT_FALSE(creased::is_path_prefix(path)) << path;
    const Finished refused = run_program({CREASED_BIN, "serve", "--port", "0", "--base-path", path});
    EXPECT_NE(refused.exit_code, 0) << path;
    EXPECT_NE(refused.errors.find("--base-path"), std::string::npos) << refused.errors;
  }
  EXPECT_TRUE(creased::is_path_prefix("/tools/meshes-2"));
}

TEST(BasePath, IsPartOfTheServerForTheCommandLine) {
  const ServerProcess server(few_and({"--base-path", "/tools/meshes"}));
  const TemporaryFolder folder;
  const std::string mesh = (folder.path() / "mesh.obj").string(), out = (folder.path() / "out.obj").string();
  std::ofstream(mesh) << small_obj();
  const Finished smoothed = run_program({CREASE_BIN, "smooth", mesh, "-o", out, "-p", "sweeps=3", "--server",
                                         fmt::format("http://127.0.0.1:{}/tools/meshes", server.port())});
  EXPECT_EQ(smoothed.exit_code, 0) << smoothed.errors;
  EXPECT_FALSE(read_file(out).empty());
}

}  // namespace
}  // namespace crease::test
