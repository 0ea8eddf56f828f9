#pragma once

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <memory>
#include <pqxx/pqxx>
#include <string>
#include <vector>

#include "tests/service/service_fixture.h"
#include "tests/support/postgresql_server.h"

namespace crease::test {

inline std::string id_of_job(const nlohmann::json& job) { return job["id"].get<std::string>(); }

inline void run_sql(const std::string& url, const std::string& statements) {
  pqxx::connection connection(url);
  pqxx::nontransaction(connection).exec(statements);
}

/// Servers and workers, each on a data folder of its own as on a machine of its own, that share a database.
class SharedStore : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { postgresql_ = std::make_unique<PostgresqlServer>(); }
  static void TearDownTestSuite() { postgresql_.reset(); }
  static PostgresqlServer& postgresql() { return *postgresql_; }

  std::unique_ptr<ServerProcess> new_server() const { return new_server(url_); }
  std::unique_ptr<Program> new_worker() { return new_worker(url_); }
  static std::unique_ptr<ServerProcess> new_server(const std::string& url) {
    return std::make_unique<ServerProcess>(
        std::vector<std::string>{"--store", url, "--workers", "0", "--max-connections", "32", "--max-streams", "8"});
  }
  std::unique_ptr<Program> new_worker(const std::string& url) {
    const auto folder = folder_.path() / fmt::format("worker{}", ++workers_made_);
    return std::make_unique<Program>(std::vector<std::string>{CREASED_BIN, "worker", "--store", url, "--data-dir",
                                                              folder, "--lease", "2", "--checkpoint-every", "0.05"});
  }
  static std::string mesh_of(const ServerProcess& server, const std::string& id) {
    return server.get("/v1/jobs/" + id + "/mesh?format=ply").body;
  }
  static nlohmann::json job_at(const ServerProcess& server, const std::string& id) {
    return server.get("/v1/jobs/" + id).json();
  }
  /// Waits for the end of a job, while the store may be away now and then.
  static nlohmann::json ended(const ServerProcess& server, const std::string& id) {
    nlohmann::json job;
    EXPECT_TRUE(eventually([&] {
      job = job_at(server, id);
      return job.contains("state") && job["state"] != "queued" && job["state"] != "running";
    })) << id;
    return job;
  }

  const std::string url_ = postgresql().create_database();
  const TemporaryFolder folder_;

 private:
  static inline std::unique_ptr<PostgresqlServer> postgresql_;
  int workers_made_ = 0;
};

}  // namespace crease::test
