#include "tests/service/service_fixture.h"

namespace crease::test {
namespace {

class WebPage : public ServiceTest {};

TEST_F(WebPage, IsServedWithAPolicyThatAllowsItsOwnFilesOnly) {
  for (const std::string path : {"/", "/docs"}) {
    const auto response = call("GET", path);
    EXPECT_EQ(response.status, 200) << path;
    EXPECT_EQ(response.header("content-type"), "text/html; charset=utf-8");
    EXPECT_EQ(response.header("content-security-policy").find("default-src 'none'; script-src 'self'"), 0U);
    const auto again = call("GET", path, {{"If-None-Match", response.header("etag")}});
    EXPECT_EQ(again.status, 304);
  }
}

TEST_F(WebPage, HasNoFilesButItsOwn) {
  for (const std::string path : {"/assets/none.js", "/assets/../index.html", "/assets/%2e%2e%2findex.html"}) {
    EXPECT_EQ(call("GET", path).status, 404) << path;
  }
}

TEST_F(WebPage, SamplesAreMeshesThatTheServiceAccepts) {
  for (const std::string name : {"part.ply", "scan.ply"}) {
    const auto sample = call("GET", "/v1/samples/" + name);
    ASSERT_EQ(sample.status, 200);
    const auto job = call("POST", "/v1/jobs?method=taubin", {{"Content-Type", "model/ply"}}, sample.body);
    EXPECT_EQ(job.status, 202) << job.body;
  }
  EXPECT_EQ(call("GET", "/v1/samples/none.ply").code(), "not_found");
}

TEST_F(WebPage, MeasuredPositionsHaveTheVerticesOfTheResult) {
  const std::string mesh = path_of(finished_job()) + "/mesh?format=json";
  const auto smooth = call("GET", mesh).json(), measured = call("GET", mesh + "&measured=true").json();
  EXPECT_EQ(measured["triangles"], smooth["triangles"]);
  EXPECT_EQ(measured["positions"].size(), smooth["positions"].size());
  EXPECT_NE(measured["positions"], smooth["positions"]);
}

}  // namespace
}  // namespace crease::test
