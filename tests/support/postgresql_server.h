#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"

namespace crease::test {

/// A PostgreSQL server of its own, in a temporary folder and behind a socket there. It ends with its destructor, or
/// with the thread that made it. Its disk is not synced: the tests kill processes, not the machine.
class PostgresqlServer {
 public:
  PostgresqlServer();
  ~PostgresqlServer();
  PostgresqlServer(const PostgresqlServer&) = delete;
  PostgresqlServer& operator=(const PostgresqlServer&) = delete;

  /// The address of a database of it.
  std::string url(const std::string& database = "postgres") const;
  /// Creates a database and returns its address.
  std::string create_database();

  /// Ends it as a crash does.
  void stop();
  void start();

 private:
  TemporaryFolder folder_;
  std::optional<Program> program_;
  int databases_ = 0;
};

/// Whether the tests keep jobs in PostgreSQL: CREASED_TEST_STORE=postgresql.
bool tests_on_postgresql();

/// The store of the tests for a data folder: "sqlite", or a database of this folder on the server of this process.
std::string store_url(const std::filesystem::path& data_dir);

}  // namespace crease::test
