#include <fstream>
#include <set>

#include "core/base/text.h"
#include "proto/error_table.h"
#include "proto/parameter_table.h"
#include "server/api/routes.h"
#include "tests/service/service_fixture.h"

namespace crease::test {
namespace {

class OpenApi : public ServiceTest {
 protected:
  static nlohmann::json document() { return call("GET", "/openapi.json").json(); }
};

TEST_F(OpenApi, HasExactlyTheRoutes) {
  const auto paths = document()["paths"];
  std::set<std::string> described, routed;
  for (const auto& [path, operations] : paths.items()) {
    for (const auto& [method, operation] : operations.items()) described.insert(method + " " + path);
  }
  for (const auto& route : creased::routes()) {
    routed.insert(fmt::format("{} {}", lower(route.method), route.path));
  }
  EXPECT_EQ(described, routed);
}

TEST_F(OpenApi, EveryRouteIsAnswered) {
  const std::string id = finished_job()["id"];
  for (const auto& route : creased::routes()) {
    std::string path = route.path;
    if (const auto brace = path.find("{id}"); brace != std::string::npos) path.replace(brace, 4, id);
    if (route.method == "DELETE" || path.find('{') != std::string::npos) continue;
    const auto response = call(route.method, path);
    EXPECT_NE(response.status, 404) << route.operation;
    EXPECT_NE(response.status, 405) << route.operation;
    const auto documented = document()["paths"][route.path][route.method == "GET" ? "get" : "post"]["responses"];
    EXPECT_TRUE(documented.contains(std::to_string(response.status))) << route.operation << response.status;
  }
}

TEST_F(OpenApi, ReferencesResolve) {
  const auto whole = document();
  const std::string text = whole.dump();
  std::size_t count = 0;
  const std::string key = "\"$ref\":\"#";
  for (auto at = text.find(key); at != std::string::npos; at = text.find(key, at + 1), ++count) {
    const auto start = at + key.size();
    const std::string pointer = text.substr(start, text.find('"', start) - start);
    EXPECT_TRUE(whole.contains(nlohmann::json::json_pointer(pointer))) << pointer;
  }
  EXPECT_GT(count, 20U);
}

TEST_F(OpenApi, ListsEveryParameterAndEveryErrorCode) {
  const auto whole = document();
  std::set<std::string> query, codes;
  for (const auto& parameter : whole["paths"]["/v1/jobs"]["post"]["parameters"]) query.insert(parameter["name"]);
  for (const auto& parameter : parameter_table()) EXPECT_EQ(query.count(std::string(parameter.name)), 1U);
  for (const auto& code : whole["components"]["schemas"]["Problem"]["properties"]["code"]["enum"]) codes.insert(code);
  for (const auto& kind : error_table()) {
    EXPECT_EQ(codes.count(std::string(kind.name)), kind.status == 0 ? 0U : 1U) << kind.name;
  }
}

TEST_F(OpenApi, CodesOfRoutesHaveAStatus) {
  for (const auto& route : creased::routes()) {
    for (const auto code : route.problems) EXPECT_GE(error_kind(code).status, 400) << error_kind(code).name;
  }
}

TEST_F(OpenApi, RoutesDocumentTheProblemsThatTheyReturn) {
  const auto whole = document();
  const auto documented = [&](const std::string& path, const std::string& method, const RawResponse& response) {
    const auto& responses = whole["paths"][path][method]["responses"];
    const auto status = std::to_string(response.status);
    ASSERT_TRUE(responses.contains(status)) << path << " " << response.body;
    const auto& codes = responses[status]["x-codes"];
    EXPECT_NE(std::find(codes.begin(), codes.end(), response.code()), codes.end()) << path << " " << response.body;
  };
  const Headers obj = {{"Content-Type", "model/obj"}};
  documented("/v1/jobs", "post", call("POST", "/v1/jobs", obj, "f 1 2 3\n"));
  documented("/v1/jobs", "post", call("POST", "/v1/jobs?x=1", obj, "f 1 2 3\n"));
  documented("/v1/jobs", "post", call("POST", "/v1/jobs?seed=-1", obj, "f 1 2 3\n"));
  documented("/v1/jobs", "post", call("POST", "/v1/jobs", {{"Content-Type", "a/b"}}, "f"));
  documented("/v1/jobs", "post",
             post_form(port(), "/v1/jobs", {{"mesh", small_obj(), "a.obj", ""}, {"weights", "[1]", "", ""}}));
  documented("/v1/jobs", "get", call("GET", "/v1/jobs?limit=0"));
  documented("/v1/jobs/{id}", "get", call("GET", "/v1/jobs/nope"));
  documented("/v1/jobs/{id}/mesh", "get", call("GET", "/v1/jobs/nope/mesh"));
  documented("/v1/jobs/{id}/ridges", "get", call("GET", "/v1/jobs/nope/ridges"));
  documented("/v1/jobs/{id}/ridges", "get", call("GET", "/v1/jobs/nope/ridges?format=obj"));
  documented("/v1/jobs/{id}/ridges", "get", call("GET", "/v1/jobs/nope/ridges", {{"Accept", "image/png"}}));
  documented("/v1/jobs/{id}/labels", "get", call("GET", "/v1/jobs/nope/labels?min=3"));
}

}  // namespace
}  // namespace crease::test
