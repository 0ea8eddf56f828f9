#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <optional>
#include <sstream>

#include "tests/service/service_fixture.h"
#include "tests/support/key_file.h"

namespace crease::test {
namespace {

namespace fs = std::filesystem;

void replace_all(std::string& text, const std::string& what, const std::string& with) {
  ASSERT_NE(text.find(what), std::string::npos) << "docker/nginx.conf has no '" << what << "' any more";
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + with.size())) {
    text.replace(at, what.size(), with);
  }
}

int free_port() {
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  EXPECT_EQ(::bind(socket, reinterpret_cast<const sockaddr*>(&address), size), 0);
  ::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size);
  ::close(socket);
  return ntohs(address.sin_port);
}

/// Debian's nginx with docker/nginx.conf. Only ports and paths are changed.
class Nginx {
 public:
  explicit Nginx(int upstream) {
    make_certificate();
    // Another program may take a free port before nginx does.
    EXPECT_TRUE(eventually([&] { return starts(upstream); })) << program_->errors();
  }
  ~Nginx() {
    program_->signal(SIGTERM);
    program_->wait();
  }
  Nginx(const Nginx&) = delete;
  Nginx& operator=(const Nginx&) = delete;

  int http() const { return http_; }
  std::string url() const { return "https://localhost:" + std::to_string(https_); }
  std::string certificate() const { return path("cert.pem"); }
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }

 private:
  void make_certificate() const {
    const Finished made =
        run_program({"/usr/bin/openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1",
                     "-nodes", "-days", "2", "-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost",
                     "-keyout", path("key.pem"), "-out", certificate()});
    ASSERT_EQ(made.exit_code, 0) << made.errors;
  }

  void write_configuration(int upstream) const {
    std::string text = read_file(fs::path(CREASED_SOURCE_DIR) / "docker/nginx.conf");
    replace_all(text, "server creased:8080;", fmt::format("server 127.0.0.1:{};", upstream));
    replace_all(text, "listen 80;", fmt::format("listen 127.0.0.1:{};", http_));
    replace_all(text, "listen 443 ", fmt::format("listen 127.0.0.1:{} ", https_));
    replace_all(text, "listen [::]:80;", "");
    replace_all(text, "listen [::]:443 ssl http2;", "");
    replace_all(text, "https://$host$request_uri", fmt::format("https://$host:{}$request_uri", https_));
    // A service below a path, which the proxy takes off; what a client claims of it is dropped.
    replace_all(text, "        location / {",
                fmt::format("        location /tools/meshes/ {{\n{}proxy_set_header X-Forwarded-Prefix /tools/meshes;\n"
                            "proxy_pass http://creased/;\n}}\n        location / {{",
                            headers_of(text)));
    replace_all(text, "/etc/nginx/tls/", folder_.path().string() + "/");
    replace_all(text, "/run/nginx.pid", path("nginx.pid"));
    replace_all(text, "/dev/stderr", path("error.log"));
    replace_all(text, "/dev/stdout", path("access.log"));
    std::ofstream(path("nginx.conf")) << text;
  }

  /// The lines that set headers, which a location with one of its own has to repeat.
  static std::string headers_of(const std::string& configuration) {
    std::string lines, line;
    std::istringstream text(configuration);
    while (std::getline(text, line)) {
      const bool sets = line.find("proxy_set_header") != std::string::npos;
      if (sets && line.find("X-Forwarded-Prefix") == std::string::npos) lines += line + "\n";
    }
    return lines;
  }

  /// False: it could not take the ports.
  bool starts(int upstream) {
    http_ = free_port();
    https_ = free_port();
    write_configuration(upstream);
    const std::string user = ::geteuid() == 0 ? " user root;" : "";
    program_.emplace(std::vector<std::string>{"/usr/sbin/nginx", "-p", folder_.path().string(), "-c",
                                              path("nginx.conf"), "-g", "daemon off;" + user});
    return eventually([this] { return listening() || program_->ended(); }) && !program_->ended();
  }

  bool listening() const {
    try {
      return RawConnection(http_).send("\r\n") && fs::exists(path("nginx.pid"));
    } catch (const std::exception&) {
      return false;
    }
  }

  TemporaryFolder folder_;
  int http_ = 0, https_ = 0;
  std::optional<Program> program_;
};

class Proxy : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (!fs::exists("/usr/sbin/nginx")) return;
    key_ = make_test_key("alice");
    file_ = std::make_unique<TestKeyFile>(std::vector<TestKey>{key_});
    server_ = std::make_unique<ServerProcess>(
        std::vector<std::string>{"--workers", "1", "--max-connections", "64", "--max-streams", "32", "--max-upload-mb",
                                 "8", "--keys", file_->path(), "--trusted-proxy", "127.0.0.1", "--log-format", "json"});
    nginx_ = std::make_unique<Nginx>(server_->port());
  }
  static void TearDownTestSuite() {
    nginx_.reset();
    server_.reset();
    file_.reset();
  }
  void SetUp() override {
    if (nginx_ == nullptr) GTEST_SKIP() << "nginx is not installed";
  }

  /// Calls curl through the proxy. Returns head and body of the answer.
  static std::string curl(const std::string& target, std::vector<std::string> more = {},
                          const std::string& key = key_.text) {
    std::vector<std::string> command = {
        "/usr/bin/curl", "--silent", "--show-error",        "--include", "--max-time",
        "600",           "--cacert", nginx_->certificate(), "--header",  "Authorization: Bearer " + key};
    command.insert(command.end(), more.begin(), more.end());
    command.push_back(nginx_->url() + target);
    const Finished finished = run_program(command);
    EXPECT_EQ(finished.exit_code, 0) << finished.errors;
    return finished.output;
  }
  static std::string body_of(const std::string& answer) { return answer.substr(answer.rfind("\r\n\r\n") + 4); }
  static bool has(const std::string& answer, const std::string& text) {
    const auto same = [](unsigned char a, unsigned char b) { return std::tolower(a) == std::tolower(b); };
    return std::search(answer.begin(), answer.end(), text.begin(), text.end(), same) != answer.end();
  }
  static std::string write_mesh(const std::string& obj) {
    std::string file = nginx_->path("mesh.obj");
    std::ofstream(file) << obj;
    return file;
  }
  static std::string submit(const std::string& query, const std::string& obj) {
    const std::string answer =
        curl("/v1/jobs?" + query, {"--header", "Content-Type: model/obj", "--data-binary", "@" + write_mesh(obj)});
    EXPECT_TRUE(has(answer, " 202")) << answer;
    return "/v1/jobs/" + nlohmann::json::parse(body_of(answer))["id"].get<std::string>();
  }

  static inline TestKey key_;
  static inline std::unique_ptr<TestKeyFile> file_;
  static inline std::unique_ptr<ServerProcess> server_;
  static inline std::unique_ptr<Nginx> nginx_;
};

TEST_F(Proxy, RedirectsPlainHttpToTls) {
  const auto response = exchange(nginx_->http(), "GET", "/v1/jobs?limit=1");
  EXPECT_EQ(response.status, 308);
  EXPECT_TRUE(response.header("location").starts_with("https://localhost:")) << response.header("location");
  EXPECT_TRUE(response.header("location").ends_with("/v1/jobs?limit=1"));
}

TEST_F(Proxy, ServesJobsAndTheirResultsInRanges) {
  const std::string job = submit(kQuick, small_obj());
  const std::string events = curl(job + "/events", {"--no-buffer"});
  EXPECT_TRUE(has(events, "event: succeeded")) << events;
  const std::string whole = body_of(curl(job + "/mesh?format=obj"));
  EXPECT_FALSE(whole.empty());
  const std::string part = curl(job + "/mesh?format=obj", {"--range", "10-19"});
  EXPECT_TRUE(has(part, " 206")) << part;
  EXPECT_EQ(body_of(part), whole.substr(10, 10));
  const std::string health = curl("/healthz");
  EXPECT_TRUE(has(health, "strict-transport-security: max-age="));
  EXPECT_TRUE(has(health, "x-content-type-options: nosniff"));
  EXPECT_FALSE(has(health, "nginx/")) << "no version";
}

TEST_F(Proxy, PassesEventsOnAtOnce) {
  const std::string job = submit(kLong, obj_text(icosphere(4)));
  server_->wait_for_state(job.substr(job.rfind('/') + 1), "running", key_.bearer());
  Program curl_of_events({"/usr/bin/curl", "-sN", "--max-time", "600", "--cacert", nginx_->certificate(), "-H",
                          "Authorization: Bearer " + key_.text, nginx_->url() + job + "/events"});
  const auto heard = [&](const std::string& event) { return curl_of_events.output().find(event) != std::string::npos; };
  EXPECT_TRUE(eventually([&] { return heard("event: progress"); })) << "while the job runs";
  EXPECT_EQ(server_->get(job, key_.bearer()).json()["state"], "running");
  curl(job + "/cancel", {"--request", "POST"});
  EXPECT_TRUE(eventually([&] { return heard("event: cancelled"); }));
  EXPECT_EQ(curl_of_events.wait(), 0);
}

TEST_F(Proxy, RefusesUploadsThatAreTooLarge) {
  const std::string big = write_mesh(std::string(9'000'000, ' '));
  const std::string ours =
      curl("/v1/jobs", {"--header", "Content-Type: model/obj", "--header", "Expect:", "--data-binary", "@" + big});
  EXPECT_TRUE(has(ours, " 413")) << ours.substr(0, 400);
  EXPECT_TRUE(has(ours, "payload_too_large")) << ours.substr(0, 400);
  const std::string proxys =
      curl("/v1/jobs", {"--header", "Content-Type: model/obj", "--header", "Content-Length: 600000000", "--http1.1",
                        "--header", "Expect: 100-continue", "--data-binary", "x"});
  EXPECT_TRUE(has(proxys, " 413")) << proxys;
  EXPECT_TRUE(has(proxys, "application/problem+json")) << proxys;
  EXPECT_TRUE(has(proxys, "payload_too_large")) << proxys;
}

TEST_F(Proxy, AsksForAKeyAndHidesTheMetrics) {
  EXPECT_TRUE(has(curl("/v1/jobs", {}, "wrong"), " 401"));
  EXPECT_TRUE(has(curl("/v1/jobs"), " 200"));
  EXPECT_TRUE(has(curl("/metrics"), " 404"));
}

TEST_F(Proxy, PassesOnTheClientsAddressAndIgnoresItsClaims) {
  curl("/v1/parameters", {"--header", "X-Forwarded-For: 203.0.113.66", "--header", "X-Request-Id: through-the-proxy"});
  ASSERT_TRUE(eventually([] { return server_->log().find("through-the-proxy") != std::string::npos; }));
  EXPECT_EQ(server_->log().find("203.0.113.66"), std::string::npos) << "the proxy drops what the client claims";
  server_->get("/v1/parameters", key_.with({{"X-Forwarded-For", "203.0.113.67"}}));
  EXPECT_TRUE(eventually([] { return server_->log().find("\"remote\":\"203.0.113.67\"") != std::string::npos; }))
      << "but creased trusts the proxy";
}

TEST_F(Proxy, ServesBelowAPath) {
  const std::string prefix = "/tools/meshes";
  const std::string answer = curl(prefix + "/v1/jobs?" + kQuick, {"--header", "Content-Type: model/obj",
                                                                  "--data-binary", "@" + write_mesh(small_obj())});
  const auto job = nlohmann::json::parse(body_of(answer));
  const std::string self = prefix + "/v1/jobs/" + job["id"].get<std::string>();
  EXPECT_TRUE(has(answer, "Location: " + self + "\r\n")) << answer;
  EXPECT_EQ(job["links"]["mesh"], self + "/mesh");
  const std::string events = curl(job["links"]["events"], {"--no-buffer"});
  EXPECT_NE(events.find("\"mesh\":\"" + self + "/mesh\""), std::string::npos) << events;
  EXPECT_EQ(nlohmann::json::parse(body_of(curl(prefix + "/openapi.json")))["servers"][0]["url"], prefix);
  EXPECT_TRUE(has(curl(prefix + "/", {}, ""), " 200"));
  EXPECT_FALSE(has(curl("/v1/jobs?limit=1", {"--header", "X-Forwarded-Prefix: /evil"}), "/evil"));

  const std::string command = fmt::format(
      "SSL_CERT_FILE={} CREASED_KEY={} exec {} smooth {} -o {} -p sweeps=3 --server {}{}/", nginx_->certificate(),
      key_.text, CREASE_BIN, write_mesh(small_obj()), nginx_->path("below.obj"), nginx_->url(), prefix);
  const Finished smoothed = run_program({"/bin/sh", "-c", command});
  EXPECT_EQ(smoothed.exit_code, 0) << smoothed.errors;
  EXPECT_FALSE(read_file(nginx_->path("below.obj")).empty());
}

TEST_F(Proxy, ServesTheCommandLine) {
  const std::string mesh = write_mesh(small_obj());
  const std::string command =
      fmt::format("SSL_CERT_FILE={} CREASED_KEY={} exec {} smooth {} -o {} -p sweeps=3 --server {}",
                  nginx_->certificate(), key_.text, CREASE_BIN, mesh, nginx_->path("out.obj"), nginx_->url());
  const Finished smoothed = run_program({"/bin/sh", "-c", command});
  EXPECT_EQ(smoothed.exit_code, 0) << smoothed.errors;
  EXPECT_FALSE(read_file(nginx_->path("out.obj")).empty());
}

}  // namespace
}  // namespace crease::test
