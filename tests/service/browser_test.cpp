#include "tests/service/service_fixture.h"
#include "tests/support/key_file.h"

namespace crease::test {
namespace {

const std::string kAllowed = "https://mesh.example.org";
const std::string kStranger = "https://evil.example.org";

/// Calls the service as browsers do, with an Origin header, and checks every answer strictly.
class Browsers : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    server_ = std::make_unique<ServerProcess>(std::vector<std::string>{"--workers", "1", "--max-connections", "32",
                                                                       "--max-streams", "8", "--cors-origin", kAllowed,
                                                                       "--cors-origin", "http://localhost:5173"});
  }
  static void TearDownTestSuite() { server_.reset(); }
  static RawResponse call(const std::string& method, const std::string& target, const Headers& headers = {},
                          const std::string& body = {}) {
    return exchange(server_->port(), method, target, headers, body);
  }
  static inline std::unique_ptr<ServerProcess> server_;
};

void expect_security_headers(const RawResponse& response) {
  EXPECT_EQ(response.header("x-content-type-options"), "nosniff");
  EXPECT_EQ(response.header("content-security-policy"), "default-src 'none'; frame-ancestors 'none'");
  EXPECT_EQ(response.header("referrer-policy"), "no-referrer");
  EXPECT_EQ(response.header("cross-origin-resource-policy"), "same-origin");
  EXPECT_EQ(response.header("server"), "creased") << "without a version";
  EXPECT_EQ(response.headers.count("server"), 1U);
  const std::string caching = response.header("cache-control");
  EXPECT_TRUE(caching == "no-store" || caching == "private, no-cache") << caching;
}

TEST_F(Browsers, WithAListedOriginMayReadAnswers) {
  for (const std::string& origin : {kAllowed, std::string("http://localhost:5173")}) {
    const auto response = call("GET", "/v1/jobs", {{"Origin", origin}});
    EXPECT_EQ(response.status, 200);
    EXPECT_EQ(response.header("access-control-allow-origin"), origin);
    EXPECT_EQ(response.header("vary"), "Origin");
    for (const std::string name : {"Location", "ETag", "Retry-After", "Content-Range", "WWW-Authenticate"}) {
      EXPECT_NE(response.header("access-control-expose-headers").find(name), std::string::npos) << name;
    }
    EXPECT_EQ(response.header("access-control-allow-credentials"), "");
  }
  EXPECT_EQ(call("GET", "/v1/jobs/nope", {{"Origin", kAllowed}}).header("access-control-allow-origin"), kAllowed)
      << "problem documents can be read, too";
  const auto submitted =
      call("POST", "/v1/jobs?" + kQuick, {{"Origin", kAllowed}, {"Content-Type", "model/obj"}}, small_obj());
  EXPECT_EQ(submitted.status, 202);
  EXPECT_EQ(submitted.header("access-control-allow-origin"), kAllowed);
}

TEST_F(Browsers, WithAnUnlistedOriginMayNotReadAnswers) {
  for (const std::string& origin : {kStranger, std::string("null"), kAllowed + ".evil.org", kAllowed + ":444",
                                    std::string("http://mesh.example.org"), std::string("*"), kAllowed + "/"}) {
    const auto response = call("GET", "/v1/jobs", {{"Origin", origin}});
    EXPECT_EQ(response.header("access-control-allow-origin"), "") << origin;
    EXPECT_EQ(response.header("vary"), "Origin") << "a cache must not give one origin the answer for another";
  }
  EXPECT_EQ(call("GET", "/v1/jobs").header("access-control-allow-origin"), "");
}

TEST_F(Browsers, AreAnsweredTheirPreflightRequests) {
  const Headers ask = {{"Access-Control-Request-Method", "POST"},
                       {"Access-Control-Request-Headers", "authorization, content-type"}};
  Headers from_allowed = ask, from_stranger = ask;
  from_allowed.emplace_back("Origin", kAllowed);
  from_stranger.emplace_back("Origin", kStranger);
  const auto allowed = call("OPTIONS", "/v1/jobs", from_allowed);
  EXPECT_EQ(allowed.status, 204);
  EXPECT_EQ(allowed.header("access-control-allow-origin"), kAllowed);
  EXPECT_NE(allowed.header("access-control-allow-methods").find("POST"), std::string::npos);
  EXPECT_NE(allowed.header("access-control-allow-headers").find("Authorization"), std::string::npos);
  EXPECT_EQ(allowed.header("access-control-max-age"), "600");
  const auto stranger = call("OPTIONS", "/v1/jobs", from_stranger);
  EXPECT_EQ(stranger.status, 204);
  EXPECT_EQ(stranger.header("access-control-allow-methods"), "");
  EXPECT_EQ(stranger.header("access-control-allow-origin"), "");
}

TEST_F(Browsers, WithAnUnlistedOriginMayChangeNothing) {
  // Browsers send multipart/form-data to other origins without a preflight request.
  const std::vector<FormPart> form = {{"mesh", small_obj(), "a.obj", ""}};
  const auto refused = post_form(server_->port(), "/v1/jobs", form, {{"Origin", kStranger}});
  EXPECT_EQ(refused.status, 403);
  EXPECT_EQ(refused.code(), "origin_not_allowed");
  EXPECT_EQ(post_form(server_->port(), "/v1/jobs", form, {{"Origin", "null"}}).status, 403);
  EXPECT_EQ(call("DELETE", "/v1/jobs/nope", {{"Origin", kStranger}}).status, 403);
  EXPECT_EQ(post_form(server_->port(), "/v1/jobs", form, {{"Origin", kAllowed}}).status, 202);
  EXPECT_EQ(post_form(server_->port(), "/v1/jobs", form, {{"Origin", "http://localhost"}}).status, 202)
      << "the same origin, as raw_request sends Host: localhost";
}

TEST(BrowsersByDefault, MayReadNothing) {
  ServerProcess server({"--workers", "0", "--max-connections", "16", "--max-streams", "4"});
  const auto response = exchange(server.port(), "GET", "/v1/jobs", {{"Origin", kAllowed}});
  for (const auto& [name, value] : response.headers) EXPECT_FALSE(name.starts_with("access-control")) << name;
  EXPECT_EQ(exchange(server.port(), "POST", "/v1/jobs", {{"Origin", kAllowed}}, "x").code(), "origin_not_allowed");
}

TEST(BrowsersOfAnOpenService, MayAllReadAnswersWithAStar) {
  ServerProcess server(
      {"--workers", "0", "--max-connections", "16", "--max-streams", "4", "--open", "--cors-origin", "*"});
  EXPECT_EQ(exchange(server.port(), "GET", "/v1/jobs", {{"Origin", kStranger}}).header("access-control-allow-origin"),
            kStranger);
}

TEST(BrowsersWithKeys, SendPreflightRequestsWithoutAKey) {
  const TestKey key = make_test_key("page");
  const TestKeyFile file({key});
  ServerProcess server({"--workers", "0", "--max-connections", "16", "--max-streams", "4", "--keys", file.path(),
                        "--cors-origin", kAllowed});
  const Headers ask = {{"Origin", kAllowed}, {"Access-Control-Request-Method", "GET"}};
  EXPECT_EQ(exchange(server.port(), "OPTIONS", "/v1/jobs", ask).status, 204);
  const auto refused = exchange(server.port(), "GET", "/v1/jobs", {{"Origin", kAllowed}});
  EXPECT_EQ(refused.status, 401);
  EXPECT_EQ(refused.header("access-control-allow-origin"), kAllowed) << "so that the page can read why";
}

TEST_F(Browsers, GetHeadersAgainstSniffingScriptsAndFraming) {
  const auto job = server_->wait_for_end(server_->submit(small_obj(), kQuick)["id"]);
  const std::string self = "/v1/jobs/" + job["id"].get<std::string>();
  for (const std::string target :
       {"/healthz", "/readyz", "/metrics", "/openapi.json", "/v1/parameters", "/v1/jobs", "/nowhere"}) {
    SCOPED_TRACE(target);
    expect_security_headers(call("GET", target));
    expect_security_headers(call("HEAD", target));
    expect_security_headers(call("PATCH", target));
    expect_security_headers(call("OPTIONS", target));
  }
  for (const std::string part : {"", "/mesh", "/mesh?format=obj", "/labels", "/ridges", "/report", "/events"}) {
    SCOPED_TRACE(part);
    expect_security_headers(call("GET", self + part));
    expect_security_headers(call("GET", self + part, {{"Range", "bytes=0-0"}}));
  }
  RawConnection broken(server_->port());
  broken.send("nonsense\r\n\r\n");
  expect_security_headers(broken.receive());
}

TEST_F(Browsers, GetNoHeadersFromFileNames) {
  const std::string evil = "a\r\nSet-Cookie: x=1\r\n\r\n<script>\";filename=b\\.obj";
  std::string encoded;
  for (const char c : evil) encoded += fmt::format("%{:02x}", static_cast<unsigned char>(c));
  const auto job = server_->wait_for_end(server_->submit(small_obj(), kQuick + "&name=" + encoded)["id"]);
  const auto response = call("GET", "/v1/jobs/" + job["id"].get<std::string>() + "/mesh?format=obj");
  ASSERT_EQ(response.status, 200);
  EXPECT_EQ(response.headers.count("set-cookie"), 0U);
  EXPECT_EQ(response.headers.count("content-disposition"), 1U);
  const std::string disposition = response.header("content-disposition");
  EXPECT_EQ(std::count(disposition.begin(), disposition.end(), '"'), 2) << disposition;
  EXPECT_EQ(disposition.find_first_of("<>\\\r\n"), std::string::npos) << disposition;

  const auto form =
      post_form(server_->port(), "/v1/jobs?sweeps=2", {{"mesh", small_obj(), "../../etc/passwd\\..\\x\t.obj", ""}});
  ASSERT_EQ(form.status, 202) << form.body;
  EXPECT_EQ(form.json()["input"]["name"].get<std::string>().find_first_of("/\\\t"), std::string::npos);
  EXPECT_EQ(form.header("location"), "/v1/jobs/" + form.json()["id"].get<std::string>());
}

TEST_F(Browsers, GetNoHeadersFromTheirRequests) {
  const auto response = call("GET", "/v1/jobs/%0d%0aSet-Cookie:%20x=1", {{"X-Request-Id", "a%0d%0ab"}});
  EXPECT_EQ(response.code(), "request_malformed");
  EXPECT_EQ(response.headers.count("set-cookie"), 0U);
  EXPECT_EQ(response.header("x-request-id").find('%'), std::string::npos);
}

TEST_F(Browsers, CannotReachFilesByPath) {
  for (const std::string path :
       {"/../../../etc/passwd", "/..%2f..%2fetc%2fpasswd", "/%2e%2e/%2e%2e/etc/passwd", "/v1/jobs/../../../etc/passwd",
        "/v1/jobs/%2e%2e%2f%2e%2e%2fcreased.db", "/v1/jobs/..%5c..%5ccreased.db/mesh", "/v1/jobs/%252e%252e/mesh",
        "/v1/jobs/creased.db%00/mesh", "/v1/jobs/.%00./report", "//etc/passwd", "/v1//jobs",
        "/v1/jobs/%c0%ae%c0%ae/mesh", "/v1/jobs/%uff0e/mesh", "/v1/jobs/%zz", "/v1/jobs/%"}) {
    const auto response = call("GET", path);
    EXPECT_EQ(response.status, 404) << path << response.body;
  }
  const auto job = server_->submit(small_obj(), kQuick)["id"].get<std::string>();
  std::string encoded;
  for (const char c : job) encoded += fmt::format("%{:02X}", static_cast<unsigned char>(c));
  EXPECT_EQ(call("GET", "/v1/jobs/" + encoded).json()["id"], job) << "an encoded id is the same id";
}

TEST_F(Browsers, RepeatedDecisiveHeadersAreRefused) {
  for (const std::string name : {"Authorization", "Content-Type", "Content-Encoding", "Origin"}) {
    const auto response = call("POST", "/v1/jobs", {{name, "a"}, {name, "b"}}, "x");
    EXPECT_EQ(response.status, 400) << name;
    EXPECT_EQ(response.code(), "request_malformed") << name;
  }
  EXPECT_EQ(call("GET", "/v1/jobs", {{"Accept", "a/b"}, {"Accept", "c/d"}, {"X-Odd", ""}, {"~!#$", "%&*"}}).status,
            200);
}

}  // namespace
}  // namespace crease::test
