#include <algorithm>
#include <ostream>

#include "tests/service/service_fixture.h"

namespace crease::test {
namespace {

struct RequestCase {
  std::string method, target, body;
  Headers headers;
  int status;
  std::string type, code;
};

std::ostream& operator<<(std::ostream& out, const RequestCase& one) {
  return out << one.method << " " << one.target << " (" << one.status << " " << one.code << ")";
}

const std::string kProblem = "application/problem+json";
const std::string kJson = "application/json";
const Headers kObjType = {{"Content-Type", "model/obj"}};

std::vector<RequestCase> request_table() {
  return {
      {"GET", "/healthz", "", {}, 200, kJson, ""},
      {"HEAD", "/healthz", "", {}, 200, kJson, ""},
      {"GET", "/readyz", "", {}, 200, kJson, ""},
      {"GET", "/metrics", "", {}, 200, "text/plain; version=0.0.4; charset=utf-8", ""},
      {"GET", "/v1/parameters", "", {}, 200, "application/schema+json", ""},
      {"GET", "/openapi.json", "", {}, 200, "application/vnd.oai.openapi+json;version=3.1", ""},
      {"GET", "/v1/jobs", "", {}, 200, kJson, ""},
      {"GET", "/v1/jobs?limit=5&state=queued", "", {}, 200, kJson, ""},
      {"GET", "http://localhost/healthz", "", {}, 200, kJson, ""},
      {"OPTIONS", "/v1/jobs", "", {}, 204, "", ""},
      {"OPTIONS", "*", "", {}, 204, "", ""},

      {"GET", "/nowhere", "", {}, 404, kProblem, "not_found"},
      {"GET", "/v1/jobs/", "", {}, 404, kProblem, "not_found"},
      {"POST", "/v1/nothing", "abc", {}, 404, kProblem, "not_found"},
      {"GET", "/v1/jobs/abc/def", "", {}, 404, kProblem, "not_found"},
      {"GET", "/v1/jobs/" + std::string(100, 'a'), "", {}, 404, kProblem, "not_found"},
      {"GET", "/v1/jobs/..%2f..%2fetc", "", {}, 404, kProblem, "not_found"},
      {"OPTIONS", "/nowhere", "", {}, 404, kProblem, "not_found"},
      {"GET", "/v1/jobs/0123456789abcdef0123", "", {}, 404, kProblem, "job_not_found"},
      {"GET", "/v1/jobs/%00", "", {}, 404, kProblem, "job_not_found"},
      {"GET", "/v1/jobs/%ff%fe", "", {}, 404, kProblem, "job_not_found"},
      {"GET", "/v1/jobs/..", "", {}, 404, kProblem, "job_not_found"},
      {"GET", "/v1/jobs/nope/events", "", {}, 404, kProblem, "job_not_found"},
      {"GET", "/v1/jobs/nope/mesh", "", {}, 404, kProblem, "job_not_found"},
      {"GET", "/v1/jobs/nope/labels", "", {}, 404, kProblem, "job_not_found"},
      {"GET", "/v1/jobs/nope/report", "", {}, 404, kProblem, "job_not_found"},
      {"POST", "/v1/jobs/nope/cancel", "", {}, 404, kProblem, "job_not_found"},
      {"DELETE", "/v1/jobs/nope", "", {}, 404, kProblem, "job_not_found"},

      {"PUT", "/v1/jobs", "x", {}, 405, kProblem, "method_not_allowed"},
      {"DELETE", "/v1/jobs", "", {}, 405, kProblem, "method_not_allowed"},
      {"POST", "/healthz", "", {}, 405, kProblem, "method_not_allowed"},
      {"BREW", "/v1/jobs", "", {}, 405, kProblem, "method_not_allowed"},
      {"GET", "/v1/jobs/nope/cancel", "", {}, 405, kProblem, "method_not_allowed"},

      {"GET", "/healthz?x=1", "", {}, 400, kProblem, "parameter_unknown"},
      {"GET", "/v1/jobs?stat=queued", "", {}, 400, kProblem, "parameter_unknown"},
      {"GET", "/v1/jobs?state=done", "", {}, 400, kProblem, "parameter_invalid"},
      {"GET", "/v1/jobs?limit=ten", "", {}, 400, kProblem, "parameter_invalid"},
      {"GET", "/v1/jobs?limit=1.5", "", {}, 400, kProblem, "parameter_invalid"},
      {"GET", "/v1/jobs?limit=0", "", {}, 400, kProblem, "parameter_out_of_range"},
      {"GET", "/v1/jobs?limit=1001", "", {}, 400, kProblem, "parameter_out_of_range"},
      {"GET", "/v1/jobs?limit=5&limit=5", "", {}, 400, kProblem, "parameter_invalid"},
      {"GET", "/v1/jobs?cursor=%00nonsense", "", {}, 400, kProblem, "parameter_invalid"},
      {"GET", "/v1/jobs/nope/mesh?format=3ds", "", {}, 400, kProblem, "parameter_invalid"},
      {"GET", "/v1/jobs/nope/mesh?snapshot=yes", "", {}, 400, kProblem, "parameter_invalid"},
      {"GET", "/v1/jobs/nope/labels?min=2", "", {}, 400, kProblem, "parameter_out_of_range"},
      {"GET", "/v1/jobs/nope/labels?min=nan", "", {}, 400, kProblem, "parameter_invalid"},

      {"POST", "/v1/jobs", "", kObjType, 400, kProblem, "body_missing"},
      {"POST", "/v1/jobs?sweps=1", "v 0 0 0", kObjType, 400, kProblem, "parameter_unknown"},
      {"POST", "/v1/jobs?sweeps=0", "v 0 0 0", kObjType, 400, kProblem, "parameter_out_of_range"},
      {"POST", "/v1/jobs?sweeps=many", "v 0 0 0", kObjType, 400, kProblem, "parameter_invalid"},
      {"POST", "/v1/jobs?sweeps=%ff", "v 0 0 0", kObjType, 400, kProblem, "parameter_invalid"},
      {"POST", "/v1/jobs?format=stl", "v 0 0 0", kObjType, 400, kProblem, "parameter_invalid"},
      {"POST", "/v1/jobs", "{}", {{"Content-Type", "application/json"}}, 415, kProblem, "content_type_unsupported"},
      {"POST", "/v1/jobs", "<x/>", {{"Content-Type", "text/xml"}}, 415, kProblem, "content_type_unsupported"},
      {"POST", "/v1/jobs", "x", {{"Content-Encoding", "gzip"}}, 415, kProblem, "content_encoding_unsupported"},
      {"POST", "/v1/jobs", "x", {{"Idempotency-Key", "a b"}}, 400, kProblem, "parameter_invalid"},
      {"POST", "/v1/jobs", "x", {{"Idempotency-Key", std::string(256, 'k')}}, 400, kProblem, "parameter_invalid"},
      {"POST", "/v1/jobs", "x", {{"Content-Type", "multipart/form-data"}}, 400, kProblem, "multipart_invalid"},
      {"POST",
       "/v1/jobs",
       "no part",
       {{"Content-Type", "multipart/form-data; boundary=b"}},
       400,
       kProblem,
       "multipart_invalid"},
      {"POST",
       "/v1/jobs",
       "\xff\xff\xff",
       {{"Content-Type", "application/x-protobuf"}},
       400,
       kProblem,
       "protobuf_invalid"},
      {"POST", "/v1/jobs", "x", {{"Expect", "200-ok"}}, 417, kProblem, "expectation_failed"},
  };
}

class Requests : public ServiceTest {};

TEST_F(Requests, AreAnsweredWithStatusTypeAndCodeOfTheTable) {
  for (const auto& one : request_table()) {
    SCOPED_TRACE(::testing::PrintToString(one));
    const auto response = call(one.method, one.target, one.headers, one.body);
    EXPECT_EQ(response.status, one.status) << response.body;
    EXPECT_EQ(response.header("content-type"), one.type);
    EXPECT_EQ(response.code(), one.code) << response.body;
    EXPECT_EQ(response.header("server"), "creased");
    EXPECT_EQ(response.header("x-content-type-options"), "nosniff");
    EXPECT_FALSE(response.header("x-request-id").empty());
    EXPECT_EQ(response.headers.count("exception_what"), 0U);
  }
}

TEST_F(Requests, ProblemsNameTheFieldAndTheExpectedValue) {
  const auto problem = call("POST", "/v1/jobs?likelihood_weight=-1", kObjType, small_obj()).json();
  EXPECT_EQ(problem["status"], 400);
  EXPECT_EQ(problem["code"], "parameter_out_of_range");
  EXPECT_EQ(problem["field"], "likelihood_weight");
  EXPECT_EQ(problem["value"], "-1");
  EXPECT_NE(problem["expected"].get<std::string>().find("0 to 1000"), std::string::npos) << problem;
  EXPECT_FALSE(problem["title"].get<std::string>().empty());
}

TEST_F(Requests, UnsupportedMethodsGetTheListOfSupportedOnes) {
  EXPECT_EQ(call("PATCH", "/v1/jobs").header("allow"), "POST, GET, HEAD, OPTIONS");
  EXPECT_EQ(call("POST", "/v1/jobs/nope").header("allow"), "GET, HEAD, DELETE, OPTIONS");
  EXPECT_EQ(call("OPTIONS", "/v1/jobs/nope/cancel").header("allow"), "POST, OPTIONS");
}

TEST_F(Requests, HeadHasTheHeadersOfGetAndNoBody) {
  const auto get = call("GET", "/v1/parameters");
  RawConnection connection(port());
  connection.send(raw_request("HEAD", "/v1/parameters") + raw_request("GET", "/healthz"));
  const auto head = connection.receive(kPatience, false);
  EXPECT_EQ(head.status, 200);
  EXPECT_EQ(head.header("content-length"), get.header("content-length"));
  EXPECT_EQ(connection.receive().json()["status"], "ok") << "the answer to HEAD had a body";
}

TEST_F(Requests, KeepTheirIdWhenItIsValid) {
  EXPECT_EQ(call("GET", "/healthz", {{"X-Request-Id", "my-id.42"}}).header("x-request-id"), "my-id.42");
  const auto problem = call("GET", "/nowhere", {{"X-Request-Id", "the-one"}});
  EXPECT_EQ(problem.json()["request_id"], "the-one");
  const auto replaced = call("GET", "/healthz", {{"X-Request-Id", "evil \" id"}}).header("x-request-id");
  EXPECT_EQ(replaced.size(), 16U);
  EXPECT_NE(call("GET", "/healthz").header("x-request-id"), call("GET", "/healthz").header("x-request-id"));
}

TEST_F(Requests, ParametersAreDescribedWithUnitRangeAndDefault) {
  const auto schema = call("GET", "/v1/parameters").json();
  const auto& sweeps = schema["properties"]["sweeps"];
  EXPECT_EQ(sweeps["type"], "integer");
  EXPECT_EQ(sweeps["minimum"], 1);
  EXPECT_TRUE(sweeps["default"].is_number_integer());
  EXPECT_FALSE(sweeps["description"].get<std::string>().empty());
}

TEST_F(Requests, AreCountedByRouteAndStatus) {
  call("GET", "/v1/jobs/nope");
  call("GET", "/nowhere");
  std::string metrics;
  const auto has = [&](const std::string& text) { return metrics.find(text) != std::string::npos; };
  // An exchange is counted once it is over, which is after its answer has arrived.
  EXPECT_TRUE(eventually([&] {
    metrics = call("GET", "/metrics").body;
    return has("creased_http_requests_total{method=\"GET\",route=\"/v1/jobs/{id}\",status=\"404\"}") &&
           has("creased_http_requests_total{method=\"none\",route=\"none\",status=\"404\"}");
  })) << metrics;
  EXPECT_TRUE(has("creased_http_request_seconds_bucket{route=\"/v1/jobs/{id}\"")) << metrics;
  EXPECT_TRUE(has("creased_event_streams 0")) << metrics;
  EXPECT_TRUE(has("creased_connections ")) << metrics;
  EXPECT_TRUE(has("creased_jobs{state=\"queued\"} 0")) << metrics;
}

}  // namespace
}  // namespace crease::test
