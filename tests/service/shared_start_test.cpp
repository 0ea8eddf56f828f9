#include <fmt/format.h>
#include <gmock/gmock.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/durable_file.h"
#include "tests/service/shared_store_fixture.h"

namespace crease::test {
namespace fs = std::filesystem;
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr std::string_view kWaiting = "waiting for the database";

/// Servers and workers that start while their database is away.
class SharedStart : public SharedStore {
 protected:
  /// `creased serve` or `creased worker`; it does not wait until the program has started.
  std::unique_ptr<Program> starting(const std::string& command, const std::string& url) {
    std::vector<std::string> words = {CREASED_BIN, command, "--store", url, "--data-dir", folder_.path() / command};
    if (command == "serve") {
      words.insert(words.end(), {"--workers", "0", "--port", "0", "--port-file", port_file_, "--max-connections", "32",
                                 "--max-streams", "8"});
    }
    return std::make_unique<Program>(words);
  }
  static bool waits(Program& program) {
    return eventually([&] { return program.ended() || program.errors().find(kWaiting) != std::string::npos; }) &&
           !program.ended();
  }
  /// The port of the server, once it listens.
  int port_of(Program& server) const {
    if (!eventually([&] { return server.ended() || fs::exists(port_file_); }) || server.ended()) return 0;
    return std::stoi(read_file(port_file_));
  }
  static std::string replaced(std::string text, const std::string& what, const std::string& by) {
    return text.replace(text.find(what), what.size(), by);
  }

  const fs::path port_file_ = folder_.path() / "port";
};

TEST_F(SharedStart, ServersAndWorkersWaitForTheDatabase) {
  postgresql().stop();
  const auto server = starting("serve", url_), worker = starting("worker", url_);
  EXPECT_TRUE(waits(*server)) << server->errors();
  EXPECT_TRUE(waits(*worker)) << worker->errors();
  postgresql().start();
  const int port = port_of(*server);
  ASSERT_NE(port, 0) << server->errors();
  EXPECT_EQ(exchange(port, "GET", "/readyz").status, 200);
  const auto job = exchange(port, "POST", "/v1/jobs?" + kQuick, {{"Content-Type", "model/obj"}}, small_obj()).json();
  const auto events = parse_events(exchange(port, "GET", "/v1/jobs/" + id_of_job(job) + "/events").body);
  ASSERT_FALSE(events.empty());
  EXPECT_EQ(events.back().type, "succeeded") << worker->errors();
  for (const auto* program : {server.get(), worker.get()}) {
    const std::string log = program->errors();
    EXPECT_EQ(log.find(kWaiting), log.rfind(kWaiting)) << "one line for many tries\n" << log;
    EXPECT_THAT(log, HasSubstr("the database answers after"));
  }
}

TEST_F(SharedStart, ServersAndWorkersThatWaitEndAtASignal) {
  postgresql().stop();
  for (const std::string command : {"serve", "worker"}) {
    for (const int signal : {SIGTERM, SIGINT}) {
      const auto program = starting(command, url_);
      EXPECT_TRUE(waits(*program)) << program->errors();
      program->signal(signal);
      EXPECT_EQ(program->wait(), 0) << command;
    }
  }
  postgresql().start();
}

TEST_F(SharedStart, AServerThatHasNotBeenAnsweredEndsAtASignal) {
  const creased::Descriptor mute(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  (folder_.path() / ".s.PGSQL.5432").string().copy(address.sun_path, sizeof address.sun_path - 1);
  ASSERT_EQ(::bind(mute.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  ASSERT_EQ(::listen(mute.get(), 1), 0);
  const auto server =
      starting("serve", fmt::format("postgresql://nobody@/none?host={}&connect_timeout=600", folder_.path().string()));
  pollfd watched{.fd = mute.get(), .events = POLLIN, .revents = 0};
  ASSERT_EQ(::poll(&watched, 1, static_cast<int>(std::chrono::milliseconds(kPatience).count())), 1);
  server->signal(SIGTERM);
  EXPECT_EQ(server->wait(), 0);
}

TEST_F(SharedStart, AReplicaThatMayBecomeThePrimaryIsAwaited) {
  const std::string change = fmt::format("ALTER DATABASE {} ", pqxx::connection(url_).dbname());
  run_sql(postgresql().url(), change + "SET default_transaction_read_only = on");
  const auto server = starting("serve", url_ + "&target_session_attrs=read-write");
  EXPECT_TRUE(waits(*server)) << server->errors();
  run_sql(postgresql().url(), change + "RESET default_transaction_read_only");
  EXPECT_NE(port_of(*server), 0) << server->errors();
}

TEST_F(SharedStart, WhatWaitingDoesNotMendEndsTheStart) {
  run_sql(postgresql().url(), "CREATE ROLE guarded LOGIN PASSWORD 'right'; CREATE ROLE reader LOGIN");
  const fs::path rules = postgresql().data_folder() / "pg_hba.conf";
  const std::string others = read_file(rules);
  std::ofstream(rules) << "local all guarded scram-sha-256\n" << others;
  run_sql(postgresql().url(), "SELECT pg_reload_conf()");
  const struct {
    std::string url, what;
  } cases[] = {
      {replaced(url_, "/test", "/none"), "database \"none"},
      {replaced(url_, "postgres@", "nobody:secret@"), "role \"nobody\" does not exist"},
      {replaced(url_, "postgres@", "guarded:secret@"), "password authentication failed for user \"guarded\""},
      {replaced(url_, "postgres@", "reader@"), "permission denied"},
      {"postgresql://nobody:secret@/creased?host=/nowhere&no_such_option=1", "no_such_option"},
  };
  for (const auto& [url, what] : cases) {
    for (const std::string command : {"serve", "worker"}) {
      const auto program = starting(command, url);
      EXPECT_EQ(program->wait(), 1) << url;
      EXPECT_THAT(program->errors(), HasSubstr(what));
      EXPECT_THAT(program->errors(), Not(HasSubstr("secret")));
    }
  }
  run_sql(postgresql().url(), "DROP ROLE guarded; DROP ROLE reader");
}

}  // namespace
}  // namespace crease::test
