#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace crease::test {

/// A PostgreSQL server of its own, in a temporary folder and behind a socket there. It ends with its destructor, or
/// with the thread that made it.
class PostgresqlServer {
 public:
  struct Options {
    int port = 5432;            ///< of its socket, and of `addresses`
    std::string addresses{};    ///< of loopback, separated by commas
    std::uint64_t disk_mb = 0;  ///< size of a disk of its own, which only root can make; 0 for the machine's
    bool synced = false;        ///< whether commits reach the disk; the tests kill processes, not the machine
  };

  PostgresqlServer();
  explicit PostgresqlServer(Options options);
  /// A replica: it streams from `primary`, whose commits wait for it from now on.
  static std::unique_ptr<PostgresqlServer> replica_of(const PostgresqlServer& primary);
  ~PostgresqlServer();
  PostgresqlServer(const PostgresqlServer&) = delete;
  PostgresqlServer& operator=(const PostgresqlServer&) = delete;

  /// The address of a database of it.
  std::string url(const std::string& database = "postgres") const;
  /// Creates a database and returns its address.
  std::string create_database();

  /// The folder of its socket, and that of its data.
  std::string socket_folder() const { return folder_.path().string(); }
  std::filesystem::path data_folder() const { return folder_.path() / "database"; }

  /// Makes a replica the primary.
  void promote();
  /// Ends it as a crash does.
  void stop();
  void start();

 private:
  PostgresqlServer(Options options, const PostgresqlServer* primary);

  const Options options_;
  TemporaryFolder folder_;
  std::optional<Program> program_;
  int databases_ = 0;
};

/// Whether the tests keep jobs in PostgreSQL: CREASED_TEST_STORE=postgresql.
bool tests_on_postgresql();

/// The store of the tests for a data folder: "sqlite", or a database of this folder on the server of this process.
std::string store_url(const std::filesystem::path& data_dir);

}  // namespace crease::test
