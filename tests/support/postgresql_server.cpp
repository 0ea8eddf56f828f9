#include "tests/support/postgresql_server.h"

#include <fmt/format.h>
#include <grp.h>
#include <pwd.h>
#include <sys/mount.h>
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

PostgresqlServer::PostgresqlServer() : PostgresqlServer(Options()) {}

PostgresqlServer::PostgresqlServer(Options options) : PostgresqlServer(std::move(options), nullptr) {}

PostgresqlServer::PostgresqlServer(Options options, const PostgresqlServer* primary) : options_(std::move(options)) {
  const fs::path data = data_folder();
  fs::create_directory(data);
  const std::string size = fmt::format("size={}m", options_.disk_mb);
  if (options_.disk_mb > 0 && ::mount("tmpfs", data.c_str(), "tmpfs", 0, size.c_str()) != 0) {
    throw std::runtime_error("mount");
  }
  fs::permissions(data, fs::perms::owner_all);
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
  const Finished made = run_program(
      as_user(primary == nullptr
                  ? std::vector<std::string>{programs() / "initdb", "--pgdata", data, "--auth", "trust", "--username",
                                             kUser, "--no-sync", "--locale", "C"}
                  : std::vector<std::string>{programs() / "pg_basebackup", "--dbname", primary->url(), "--pgdata", data,
                                             "--write-recovery-conf", "--checkpoint", "fast", "--no-sync"}));
  if (made.exit_code != 0) throw std::runtime_error("a new database: " + made.errors);
  start();
}

std::unique_ptr<PostgresqlServer> PostgresqlServer::replica_of(const PostgresqlServer& primary) {
  std::unique_ptr<PostgresqlServer> replica(new PostgresqlServer(Options(), &primary));
  pqxx::connection connection(primary.url());
  pqxx::nontransaction work(connection);
  work.exec("ALTER SYSTEM SET synchronous_standby_names = '*'");
  work.exec("SELECT pg_reload_conf()");
  return replica;
}

PostgresqlServer::~PostgresqlServer() {
  stop();
  if (options_.disk_mb > 0) ::umount2(data_folder().c_str(), MNT_DETACH);
}

void PostgresqlServer::promote() {
  pqxx::connection connection(url());
  pqxx::nontransaction work(connection);
  // What the replica was told to wait for would be a replica of its own.
  work.exec("SELECT pg_promote()");
  work.exec("ALTER SYSTEM RESET synchronous_standby_names");
  work.exec("SELECT pg_reload_conf()");
}

std::string PostgresqlServer::url(const std::string& database) const {
  return fmt::format("postgresql://{}@/{}?host={}&port={}", kUser, database, socket_folder(), options_.port);
}

std::string PostgresqlServer::create_database() {
  const std::string name = fmt::format("test{}", ++databases_);
  pqxx::connection connection(url());
  pqxx::nontransaction(connection).exec("CREATE DATABASE " + name);
  return url(name);
}

void PostgresqlServer::start() {
  program_.emplace(
      as_user({programs() / "postgres", "-D", data_folder(), "-c", "listen_addresses=" + options_.addresses, "-c",
               fmt::format("port={}", options_.port), "-c", "unix_socket_directories=" + folder_.path().string(), "-c",
               options_.synced ? "fsync=on" : "fsync=off", "-c", "max_connections=300"}));
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
