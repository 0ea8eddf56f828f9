#include "tests/service/service_fixture.h"

namespace crease::test {
namespace {

/// A service with a small limit on uploads, and with timeouts that no test reaches.
class Connection : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    server_ = std::make_unique<ServerProcess>(
        std::vector<std::string>{"--workers", "0", "--max-connections", "64", "--max-streams", "4", "--max-upload-mb",
                                 "1", "--head-timeout", "10000", "--body-timeout", "10000", "--idle-timeout", "10000"});
  }
  static void TearDownTestSuite() { server_.reset(); }
  static int port() { return server_->port(); }
  static RawResponse raw(const std::string& bytes) {
    RawConnection connection(port());
    connection.send(bytes);
    return connection.receive();
  }
  static void expect_alive() { EXPECT_EQ(server_->get("/healthz").status, 200); }

  static inline std::unique_ptr<ServerProcess> server_;
};

struct HeadCase {
  std::string bytes;
  int status;
  std::string code;
};

TEST_F(Connection, RefusesAmbiguousHeads) {
  const std::string post = "POST /v1/jobs HTTP/1.1\r\nHost: x\r\n", get = "GET /healthz HTTP/1.1\r\n";
  const std::vector<HeadCase> cases = {
      {post + "Content-Length: 5\r\nContent-Length: 6\r\n\r\nhello", 400, "request_malformed"},
      {post + "Content-Length: 5\r\nContent-Length: 5\r\n\r\nhello", 400, "request_malformed"},
      {post + "Content-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n", 400, "request_malformed"},
      {post + "Content-Length: 5, 5\r\n\r\nhello", 400, "request_malformed"},
      {post + "Content-Length: -5\r\n\r\nhello", 400, "request_malformed"},
      {post + "Content-Length: +5\r\n\r\nhello", 400, "request_malformed"},
      {post + "Content-Length: 5x\r\n\r\nhello", 400, "request_malformed"},
      {post + "Content-Length: 99999999999999999999999\r\n\r\nhello", 400, "request_malformed"},
      {post + "Content-Length:\r\n\r\nhello", 400, "request_malformed"},
      {post + "Transfer-Encoding: gzip, chunked\r\n\r\n0\r\n\r\n", 501, "transfer_encoding_unsupported"},
      {post + "Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n", 501,
       "transfer_encoding_unsupported"},
      {"POST /v1/jobs HTTP/1.0\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n", 400, "request_malformed"},
      {post + "Transfer-Encoding : chunked\r\n\r\n0\r\n\r\n", 400, "request_malformed"},
      {get + "Host: x\r\n folded: y\r\n\r\n", 400, "request_malformed"},
      {get + "Host: x\r\nNoColon\r\n\r\n", 400, "request_malformed"},
      {get + "Host: x\r\nA: b\nC: d\r\n\r\n", 400, "request_malformed"},
      {get + std::string("Host: x\r\nA: b\0c\r\n\r\n", 19), 400, "request_malformed"},
      {get + "\r\n", 400, "request_malformed"},
      {get + "Host: x\r\nHost: y\r\n\r\n", 400, "request_malformed"},
      {get + "Host: x:abc\r\n\r\n", 400, "request_malformed"},
      {get + "Host: x:80:81\r\n\r\n", 400, "request_malformed"},
      {get + "Host: [zz]\r\n\r\n", 400, "request_malformed"},
      {get + "Host: [::1]x\r\n\r\n", 400, "request_malformed"},
      {get + "Host: [::1\r\n\r\n", 400, "request_malformed"},
      {"GET  /healthz HTTP/1.1\r\nHost: x\r\n\r\n", 400, "request_malformed"},
      {"GET /healthz\r\nHost: x\r\n\r\n", 400, "request_malformed"},
      {"GET /health\x80z HTTP/1.1\r\nHost: x\r\n\r\n", 400, "request_malformed"},
      {"G@T /healthz HTTP/1.1\r\nHost: x\r\n\r\n", 400, "request_malformed"},
      {"GET healthz HTTP/1.1\r\nHost: x\r\n\r\n", 400, "request_malformed"},
      {"GET /healthz HTTP/2.0\r\nHost: x\r\n\r\n", 505, "http_version_unsupported"},
      {"\x16\x03\x01 TLS is not spoken\r\n\r\n", 400, "request_malformed"},
      {"GET /" + std::string(9'000, 'a') + " HTTP/1.1\r\nHost: x\r\n\r\n", 414, "uri_too_long"},
      {get + "Host: x\r\nA: " + std::string(20'000, 'a') + "\r\n\r\n", 431, "headers_too_large"},
  };
  for (const auto& one : cases) {
    SCOPED_TRACE(one.bytes.substr(0, 120));
    const auto response = raw(one.bytes);
    EXPECT_EQ(response.status, one.status);
    EXPECT_EQ(response.code(), one.code);
    EXPECT_EQ(response.header("connection"), "close");
  }
  std::string many = get + "Host: x\r\n";
  for (int i = 0; i < 100; ++i) many += fmt::format("X-{}: y\r\n", i);
  EXPECT_EQ(raw(many + "\r\n").code(), "headers_too_large");
  expect_alive();
}

TEST_F(Connection, AnswersEveryFormOfAHost) {
  for (const std::string host :
       {"x", "x:", "x:8080", "127.0.0.1:80", "[::1]", "[::1]:8080", "[::ffff:127.0.0.1]", ""}) {
    EXPECT_EQ(raw("GET /healthz HTTP/1.1\r\nHost: " + host + "\r\nConnection: close\r\n\r\n").status, 200) << host;
  }
}

TEST_F(Connection, EndsWhenAHeaderHasNoEnd) {
  RawConnection connection(port());
  connection.send("GET /healthz HTTP/1.1\r\nX: ");
  const std::string piece(64 * 1024, 'a');
  for (int i = 0; i < 64 && connection.send(piece); ++i) {
  }
  EXPECT_EQ(connection.receive().code(), "headers_too_large");
  EXPECT_TRUE(connection.is_closed());
  expect_alive();
}

TEST_F(Connection, RefusesBodiesThatAreTooLargeOrShort) {
  const std::string post = "POST /v1/jobs HTTP/1.1\r\nHost: x\r\nContent-Type: model/obj\r\n";
  EXPECT_EQ(raw(post + "Content-Length: 2000000\r\n\r\nv").code(), "payload_too_large");
  EXPECT_EQ(raw(post + "Transfer-Encoding: chunked\r\n\r\nfffffff\r\nv").code(), "payload_too_large");
  EXPECT_EQ(raw("POST /v1/jobs/x/cancel HTTP/1.1\r\nHost: x\r\nContent-Length: 70000\r\n\r\nv").code(),
            "payload_too_large");

  RawConnection chunks(port());
  chunks.send(post + "Transfer-Encoding: chunked\r\n\r\n");
  const std::string chunk = "10000\r\n" + std::string(0x10000, ' ') + "\r\n";
  for (int i = 0; i < 40 && chunks.send(chunk); ++i) {
  }
  EXPECT_EQ(chunks.receive().code(), "payload_too_large") << "counted over all chunks";
  expect_alive();
}

TEST_F(Connection, RefusesMalformedChunks) {
  const std::string post =
      "POST /v1/jobs HTTP/1.1\r\nHost: x\r\nContent-Type: model/obj\r\nTransfer-Encoding: chunked\r\n\r\n";
  for (const std::string bad :
       {"xyz\r\nv\r\n0\r\n\r\n", "3\r\nv 0XX0\r\n\r\n", "-1\r\nv\r\n0\r\n\r\n", "0x3\r\nv 0\r\n0\r\n\r\n",
        "3\nv 0\r\n0\r\n\r\n", "fffffffffffffffff\r\nv\r\n", "\r\n\r\n"}) {
    SCOPED_TRACE(bad);
    const auto response = raw(post + bad);
    EXPECT_EQ(response.status, 400);
    EXPECT_EQ(response.code(), "body_incomplete");
    EXPECT_EQ(response.header("connection"), "close");
  }
  EXPECT_EQ(raw(post + "1;" + std::string(400, 'e')).code(), "body_incomplete") << "an endless chunk extension";
  std::string trailers = "0\r\n";
  for (int i = 0; i < 100; ++i) trailers += "T: x\r\n";
  EXPECT_EQ(raw(post + trailers).code(), "body_incomplete") << "endless trailers";
}

TEST_F(Connection, NeverRunsTheRestOfARefusedBodyAsARequest) {
  const std::string hidden = "GET /v1/parameters HTTP/1.1\r\nHost: x\r\n\r\n";
  for (const std::string start :
       {"POST /nowhere HTTP/1.1\r\n", "POST /v1/jobs?nonsense=1 HTTP/1.1\r\n", "PUT /v1/jobs HTTP/1.1\r\n",
        "POST /v1/jobs HTTP/1.1\r\nContent-Encoding: gzip\r\n", "POST /v1/jobs HTTP/1.1\r\nContent-Type: text/css\r\n",
        "POST /v1/jobs HTTP/1.1\r\nContent-Type: multipart/form-data; boundary=b\r\n", "GET /healthz HTTP/1.1\r\n",
        "DELETE /v1/jobs/nope HTTP/1.1\r\n"}) {
    SCOPED_TRACE(start);
    RawConnection connection(port());
    connection.send(fmt::format("{}Host: x\r\nContent-Length: {}\r\n\r\n{}", start, hidden.size(), hidden));
    EXPECT_NE(connection.receive().status, 0);
    connection.send(raw_request("GET", "/healthz", {{"X-Request-Id", "the-next"}}));
    const auto second = connection.receive();
    EXPECT_TRUE(second.status == 0 || second.header("x-request-id") == "the-next") << second.body;
  }
}

TEST_F(Connection, RefusesCompressedBodies) {
  for (const std::string encoding : {"gzip", "deflate", "br", "GZIP", "x-gzip"}) {
    const auto response =
        exchange(port(), "POST", "/v1/jobs", {{"Content-Encoding", encoding}}, std::string(1000, '\x1f'));
    EXPECT_EQ(response.status, 415);
    EXPECT_EQ(response.code(), "content_encoding_unsupported");
  }
  EXPECT_EQ(exchange(port(), "GET", "/v1/parameters", {{"Accept-Encoding", "gzip, br"}}).header("content-encoding"),
            "");
}

TEST_F(Connection, ServesManyRequestsAndPipelines) {
  RawConnection connection(port());
  std::string requests;
  for (int i = 0; i < 200; ++i) requests += raw_request("GET", "/healthz");
  connection.send(requests);
  for (int i = 0; i < 200; ++i) ASSERT_EQ(connection.receive().status, 200) << i;
  connection.send(raw_request("GET", "/healthz", {{"Connection", "close"}}));
  EXPECT_EQ(connection.receive().header("connection"), "close");
  EXPECT_TRUE(connection.is_closed());
}

TEST_F(Connection, OfAnHttp10ClientEndsAfterTheAnswer) {
  RawConnection connection(port());
  connection.send("GET /healthz HTTP/1.0\r\n\r\n");
  EXPECT_EQ(connection.receive().status, 200);
  EXPECT_TRUE(connection.is_closed());
}

/// Sends `piece` again and again, more often than the server's time for the whole, until it answers.
RawResponse answer_to_trickle(RawConnection& connection, const std::string& piece) {
  RawResponse response;
  EXPECT_TRUE(eventually([&] {
    connection.send(piece);
    response = connection.receive(std::chrono::milliseconds(50));
    return response.status != 0;
  }));
  return response;
}

ServerProcess with_timeouts(const std::string& head, const std::string& body, const std::string& idle) {
  return ServerProcess({"--workers", "0", "--max-connections", "24", "--max-streams", "4", "--head-timeout", head,
                        "--body-timeout", body, "--idle-timeout", idle});
}

const std::string kShort = "0.5", kEndless = "10000";

TEST(ConnectionTimes, HeadersThatTrickleInAreCut) {
  const ServerProcess server = with_timeouts(kShort, kEndless, kEndless);
  RawConnection connection(server.port());
  connection.send("GET /healthz HTTP/1.1\r\nHost: x\r\n");
  const auto response = answer_to_trickle(connection, "X: y\r\n");
  EXPECT_EQ(response.code(), "request_timeout");
  EXPECT_EQ(response.status, 408);
  EXPECT_TRUE(connection.is_closed());
}

TEST(ConnectionTimes, BodiesThatTrickleInOrStopAreCut) {
  const ServerProcess server = with_timeouts(kEndless, kShort, kEndless);
  const std::string head =
      "POST /v1/jobs HTTP/1.1\r\nHost: x\r\nContent-Type: model/obj\r\nContent-Length: 1000\r\n\r\n";
  RawConnection slow(server.port()), silent(server.port());
  slow.send(head);
  silent.send(head + "v");
  EXPECT_EQ(answer_to_trickle(slow, "v").code(), "request_timeout");
  EXPECT_EQ(silent.receive().code(), "request_timeout");
  EXPECT_TRUE(slow.is_closed());
  EXPECT_TRUE(silent.is_closed());
}

/// A connection on which the server has answered a request. One that is refused, or cut on a busy machine, is replaced.
RawConnection answered_connection(int port) {
  std::optional<RawConnection> connection;
  EXPECT_TRUE(eventually([&] {
    connection.emplace(port);
    connection->send(raw_request("GET", "/healthz"));
    return connection->receive().status == 200;
  }));
  return std::move(*connection);
}

TEST(ConnectionTimes, IdleConnectionsEnd) {
  const ServerProcess server = with_timeouts(kEndless, kEndless, kShort);
  EXPECT_TRUE(answered_connection(server.port()).is_closed());
  EXPECT_TRUE(RawConnection(server.port()).is_closed()) << "also one that has never asked";
}

TEST(ConnectionBound, IsKeptAndWhoIsWithinGoesOn) {
  constexpr int kBound = 24, kOver = 7;
  const ServerProcess server({"--workers", "0", "--max-connections", std::to_string(kBound), "--max-streams", "4",
                              "--head-timeout", kEndless, "--idle-timeout", kEndless});
  // The connection that asked whether the server is up may be counted for a moment, so only those that were answered
  // are sure to be within.
  std::vector<RawConnection> within, over;
  for (int i = 0; i < kBound; ++i) {
    within.push_back(answered_connection(server.port()));
    within.back().send("GET /hea");
  }
  for (int i = 0; i < kOver; ++i) {
    over.emplace_back(server.port());
    over.back().send("GET /hea");
  }
  for (auto& connection : over) {
    const auto response = connection.receive();
    EXPECT_EQ(response.status, 503);
    EXPECT_EQ(response.code(), "too_many_connections");
    EXPECT_EQ(response.header("retry-after"), "1");
  }
  for (auto& connection : within) {
    connection.send("lthz HTTP/1.1\r\nHost: x\r\n\r\n");
    EXPECT_EQ(connection.receive().status, 200);
  }
  within.clear();
  EXPECT_TRUE(eventually([&] { return server.get("/healthz").status == 200; }));
}

}  // namespace
}  // namespace crease::test
