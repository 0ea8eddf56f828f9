#include "tests/support/postgresql_server.h"

#include <fmt/format.h>
#include <grp.h>
#include <pwd.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <map>
#include <pqxx/pqxx>
#include <stdexcept>
#include <vector>

#include "tests/support/patience.h"

namespace crease::test {
namespace fs = std::filesystem;
namespace {

constexpr const char* kUser = "postgres";

/// The folder of the programs of the newest version that Debian's packages have installed.
fs::path programs() {
  std::vector<fs::path> found;
  std::error_code none;
  for (const auto& version : fs::directory_iterator("/usr/lib/postgresql", none)) {
    if (fs::exists(version.path() / "bin" / "initdb")) found.push_back(version.path() / "bin");
  }
  if (found.empty()) throw std::runtime_error("there is no /usr/lib/postgresql: docker/install-packages.sh test");
  return *std::ranges::max_element(found);
}

/// A command of PostgreSQL, which refuses root, as its user, and to end with this thread.
std::vector<std::string> as_user(const std::vector<std::string>& command) {
  std::vector<std::string> whole = {"/usr/bin/setpriv", "--pdeathsig", "QUIT"};
  if (::geteuid() == 0) whole.insert(whole.end(), {"--reuid", kUser, "--regid", kUser, "--clear-groups"});
  whole.insert(whole.end(), command.begin(), command.end());
  return whole;
}

}  // namespace

PostgresqlServer::PostgresqlServer() {
  const fs::path data = folder_.path() / "database";
  fs::create_directory(data);
  if (::geteuid() == 0) {
    const passwd* const user = ::getpwnam(kUser);
    if (user == nullptr) throw std::runtime_error("there is no user postgres");
    for (const auto& path : {folder_.path(), data}) {
      if (::chown(path.c_str(), user->pw_uid, user->pw_gid) != 0) throw std::runtime_error("chown");
    }
    // The user must reach the folder through those above.
    for (fs::path above = folder_.path().parent_path();
         above != above.root_path() && above != fs::temp_directory_path(); above = above.parent_path()) {
      fs::permissions(above, fs::perms::others_exec | fs::perms::group_exec, fs::perm_options::add);
    }
  }
  const Finished made = run_program(as_user(
      {programs() / "initdb", "--pgdata", data, "--auth", "trust", "--username", kUser, "--no-sync", "--locale", "C"}));
  if (made.exit_code != 0) throw std::runtime_error("initdb: " + made.errors);
  start();
}

PostgresqlServer::~PostgresqlServer() { stop(); }

std::string PostgresqlServer::url(const std::string& database) const {
  return fmt::format("postgresql://{}@/{}?host={}", kUser, database, folder_.path().string());
}

std::string PostgresqlServer::create_database() {
  const std::string name = fmt::format("test{}", ++databases_);
  pqxx::connection connection(url());
  pqxx::nontransaction(connection).exec("CREATE DATABASE " + name);
  return url(name);
}

void PostgresqlServer::start() {
  program_.emplace(
      as_user({programs() / "postgres", "-D", folder_.path() / "database", "-c", "listen_addresses=", "-c",
               "unix_socket_directories=" + folder_.path().string(), "-c", "fsync=off", "-c", "max_connections=300"}));
  const bool ready = eventually([&] {
    try {
      pqxx::connection connection(url());
      return true;
    } catch (const pqxx::broken_connection&) {
      return program_->ended();
    }
  });
  if (!ready || program_->ended()) throw std::runtime_error("PostgreSQL does not start: " + program_->errors());
}

void PostgresqlServer::stop() {
  program_->signal(SIGQUIT);
  program_->wait();
}

bool tests_on_postgresql() {
  const char* const store = std::getenv("CREASED_TEST_STORE");
  return store != nullptr && std::string(store) == "postgresql";
}

std::string store_url(const fs::path& data_dir) {
  if (!tests_on_postgresql()) return "sqlite";
  static PostgresqlServer server;
  static std::map<fs::path, std::string> databases;
  auto& url = databases[data_dir];
  if (url.empty()) url = server.create_database();
  return url;
}

}  // namespace crease::test
