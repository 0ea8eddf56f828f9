#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include "core/measure/noise.h"
#include "tests/service/shared_store_fixture.h"
#include "tests/support/store_audit.h"

namespace crease::test {
namespace fs = std::filesystem;
namespace {

using testing::IsEmpty;

TEST_F(SharedStore, AJobOfOneServerIsSeenWholeOnTheOther) {
  const auto one = new_server(), other = new_server();
  const auto worker = new_worker();
  const std::string id = id_of_job(one->submit(small_obj(), kQuick));
  EXPECT_EQ(other->wait_for_end(id)["state"], "succeeded") << "its events are told on the other server";
  EXPECT_EQ(job_at(*one, id), job_at(*other, id));
  EXPECT_EQ(mesh_of(*one, id), mesh_of(*other, id));
  EXPECT_FALSE(mesh_of(*one, id).empty());
  const auto link = exchange(one->port(), "POST", "/v1/jobs/" + id + "/links?result=report").json();
  EXPECT_EQ(other->get(link["url"].get<std::string>()).status, 200) << "links are good on every server";
  EXPECT_EQ(exchange(other->port(), "DELETE", "/v1/jobs/" + id).status, 204);
  EXPECT_EQ(one->get("/v1/jobs/" + id).code(), "job_not_found");
  EXPECT_THAT(faults_of_shared_store(url_, {}, true), IsEmpty());
}

TEST_F(SharedStore, AJobIsCancelledThroughAnyServer) {
  const auto one = new_server(), other = new_server();
  const auto worker = new_worker();
  const std::string id = id_of_job(one->submit(obj_text(cube(14)), kLong));
  one->wait_for_state(id, "running");
  EXPECT_EQ(exchange(other->port(), "POST", "/v1/jobs/" + id + "/cancel").status, 202);
  EXPECT_EQ(one->wait_for_end(id)["state"], "cancelled");
}

TEST_F(SharedStore, AJobRemovedThroughOneServerIsGoneOnTheOther) {
  const auto one = new_server(), other = new_server();
  const auto worker = new_worker();
  const auto count_of_running = [&](const std::string& count) {
    return eventually([&] {
      const std::string line = "creased_jobs{state=\"running\"} " + count + "\n";
      return one->get("/metrics").body.find(line) != std::string::npos;
    });
  };
  const std::string id = id_of_job(one->submit(obj_text(cube(14)), kLong));
  EXPECT_TRUE(count_of_running("1"));
  RawConnection stream(one->port());
  stream.send(raw_request("GET", "/v1/jobs/" + id + "/events"));
  ASSERT_THAT(stream.receive_until("event: progress"), testing::HasSubstr("event: progress"));
  EXPECT_EQ(exchange(other->port(), "DELETE", "/v1/jobs/" + id).status, 204);
  EXPECT_THAT(stream.receive_until(": the job was removed"), testing::HasSubstr(": the job was removed"));
  EXPECT_TRUE(count_of_running("0"));
}

/// Two servers and four workers, of which some are killed while jobs run and others wait.
class SharedKills : public SharedStore {
 protected:
  static const std::string& part() {
    static const std::string text = obj_text(add_noise(cube(10), 0.2, 1, NoiseKind::kNormal));
    return text;
  }
  /// What a server alone gives for the runs.
  static std::vector<std::string> expected() {
    const ServerProcess alone({"--store", "sqlite", "--workers", "1"});
    std::vector<std::string> meshes;
    for (const auto& run : kRuns) {
      const std::string id = id_of_job(alone.submit(part(), run));
      EXPECT_EQ(alone.wait_for_end(id)["state"], "succeeded");
      meshes.push_back(mesh_of(alone, id));
    }
    return meshes;
  }
  ServerProcess& some_server() { return *servers_.at(random_() % servers_.size()); }

  /// Right after the database was away, a call may still be refused. Whoever sends it again is served.
  std::string submitted(const std::string& run) {
    std::string id;
    EXPECT_TRUE(eventually([&] {
      try {
        id = id_of_job(some_server().submit(part(), run));
      } catch (const std::runtime_error&) {
        return false;
      }
      return true;
    }));
    return id;
  }
  void submit_all() {
    for (std::size_t run = 0; run < kRuns.size(); ++run) {
      const std::string id = submitted(kRuns.at(run));
      run_of_[id] = run;
      acknowledged_.insert(id);
    }
  }
  bool some_job_is(const std::string& state) {
    return eventually([&] {
      const auto found = some_server().get("/v1/jobs?state=" + state);
      return found.status == 200 && !found.json()["jobs"].empty();
    });
  }

  void kill_workers(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) workers_.at(i)->signal(SIGKILL);
    for (std::size_t i = 0; i < count; ++i) workers_.at(i) = new_worker();
  }
  void kill_server() {
    auto& server = servers_.at(random_() % servers_.size());
    server->signal(SIGKILL);
    server = new_server();
  }
  void kill_database() {
    postgresql().stop();
    postgresql().start();
    for (const auto& server : servers_) {
      EXPECT_TRUE(eventually([&] { return server->get("/readyz").status == 200; })) << "it finds the database again";
    }
  }
  void kill_all() {
    for (const auto& server : servers_) server->signal(SIGKILL);
    for (const auto& worker : workers_) worker->signal(SIGKILL);
    postgresql().stop();
    for (auto& worker : workers_) worker = new_worker();
    postgresql().start();
    for (auto& server : servers_) server = new_server();
  }

  /// Nothing is lost, and what has ended stays as its user has seen it.
  void look(const std::string& victim) {
    EXPECT_THAT(faults_of_shared_store(url_, acknowledged_), IsEmpty()) << victim;
    for (const std::string& id : acknowledged_) {
      nlohmann::json job;
      EXPECT_TRUE(eventually([&] { return (job = job_at(some_server(), id)).contains("state"); }));
      if (const auto seen = ended_.find(id); seen != ended_.end()) {
        EXPECT_EQ(job, seen->second) << victim;
      }
      if (job["state"] != "queued" && job["state"] != "running") ended_[id] = job;
    }
  }

  static inline const std::vector<std::string> kRuns = {"sweeps=300&threads=1", "sweeps=200&process=vertex",
                                                        "sweeps=150"};
  std::array<std::unique_ptr<ServerProcess>, 2> servers_ = {new_server(), new_server()};
  std::array<std::unique_ptr<Program>, 4> workers_ = {new_worker(), new_worker(), new_worker(), new_worker()};
  std::map<std::string, std::size_t> run_of_;
  std::set<std::string> acknowledged_;
  std::map<std::string, nlohmann::json> ended_;
  std::mt19937 random_{std::random_device{}()};
};

TEST_F(SharedKills, NothingAcknowledgedIsLostWhateverIsKilled) {
  const auto meshes = expected();
  const std::vector<std::pair<std::string, std::function<void()>>> victims = {
      {"a worker", [this] { kill_workers(1); }},
      {"a server", [this] { kill_server(); }},
      {"the database", [this] { kill_database(); }},
      {"all workers", [this] { kill_workers(workers_.size()); }},
      {"all together", [this] { kill_all(); }}};
  for (const auto& [name, kill] : victims) {
    submit_all();
    submit_all();
    ASSERT_TRUE(some_job_is("queued"));
    ASSERT_TRUE(some_job_is("running"));
    kill();
    look(name);
  }
  for (const auto& [id, run] : run_of_) {
    EXPECT_EQ(ended(some_server(), id)["state"], "succeeded") << id;
    EXPECT_TRUE(mesh_of(some_server(), id) == meshes.at(run)) << kRuns.at(run) << ": " << id;
  }
  look("the end");
}

TEST_F(SharedStore, ProgressComesMoreSlowlyFromASlowDatabase) {
  const auto server = new_server();
  run_sql(url_,
          "CREATE TABLE published (at timestamptz);"
          "CREATE FUNCTION be_slow() RETURNS trigger LANGUAGE plpgsql AS"
          " 'BEGIN INSERT INTO published VALUES (clock_timestamp()); PERFORM pg_sleep(0.05); RETURN new; END';"
          "CREATE TRIGGER be_slow BEFORE UPDATE OF progress ON jobs FOR EACH ROW"
          " WHEN (old.state = 'running' AND new.state = 'running') EXECUTE FUNCTION be_slow()");
  const auto worker = new_worker();
  const std::string id = id_of_job(server->submit(obj_text(cube(14)), kLong));
  const auto value = [&](const std::string& sql) {
    pqxx::connection connection(url_);
    return pqxx::nontransaction(connection).exec1(sql)[0].as<double>(0);
  };
  EXPECT_TRUE(eventually([&] { return value("SELECT count(*) FROM published") >= 4; }));
  EXPECT_GE(value("SELECT min(pause) FROM"
                  " (SELECT extract(epoch FROM at - lag(at) OVER (ORDER BY at)) AS pause FROM published) AS pauses"),
            10 * 0.05)
      << "publishing takes at most a tenth of the time";
  EXPECT_EQ(exchange(server->port(), "DELETE", "/v1/jobs/" + id).status, 204);
}

TEST_F(SharedStore, ABackupTakenWhileAJobRunsIsWhole) {
  const auto server = new_server();
  const auto worker = new_worker();
  const std::string part = obj_text(add_noise(cube(10), 0.2, 1, NoiseKind::kNormal));
  const std::string id = id_of_job(server->submit(part, "sweeps=300&threads=1"));
  server->wait_for_state(id, "running");
  worker->signal(SIGSTOP);  // the job must not end before the backup begins
  const std::string backup = folder_.path() / "backup";
  const Finished dumped = run_program({"/usr/bin/pg_dump", "--format", "custom", "--file", backup, url_});
  worker->signal(SIGCONT);
  ASSERT_EQ(dumped.exit_code, 0) << dumped.errors;
  EXPECT_EQ(server->wait_for_end(id)["state"], "succeeded");

  const std::string url = postgresql().create_database();
  const Finished restored = run_program({"/usr/bin/pg_restore", "--dbname", url, backup});
  ASSERT_EQ(restored.exit_code, 0) << restored.errors;
  const auto later = new_server(url);
  EXPECT_EQ(job_at(*later, id)["state"], "running");
  const auto other_worker = new_worker(url);
  EXPECT_EQ(ended(*later, id)["state"], "succeeded");
  EXPECT_TRUE(mesh_of(*later, id) == mesh_of(*server, id));
  EXPECT_THAT(faults_of_shared_store(url, {id}), IsEmpty());
}

// Progress and claims are committed without waiting for the disk, so a crash may take back what was told of them.
TEST_F(SharedStore, AStreamHearsOfChangesAfterACrashThatLostOthers) {
  const auto one = new_server(), other = new_server();
  const std::string id = id_of_job(one->submit(small_obj(), kQuick));
  RawConnection stream(one->port());
  stream.send(raw_request("GET", "/v1/jobs/" + id + "/events"));
  ASSERT_THAT(stream.receive_until("\"queued\""), testing::HasSubstr("\"queued\""));
  postgresql().stop();
  postgresql().start();
  run_sql(url_, "SELECT setval('change_numbers', 1)");
  for (const auto* server : {one.get(), other.get()}) {
    EXPECT_TRUE(eventually([&] { return server->get("/readyz").json().contains("status"); }));
  }
  EXPECT_TRUE(eventually([&] { return exchange(other->port(), "POST", "/v1/jobs/" + id + "/cancel").status == 200; }));
  EXPECT_THAT(stream.receive_until("\"cancelled\""), testing::HasSubstr("\"cancelled\""));
}

TEST_F(SharedStore, TablesOfTheReleasedSchemaAreMigratedWithTheirJobs) {
  run_sql(url_, read_file(fs::path(CREASED_SOURCE_DIR) / "tests/service/postgresql_schema_1.sql"));
  run_sql(url_, "UPDATE jobs SET expires = now_ms() + 3600000 WHERE expires IS NOT NULL");
  const auto server = new_server();
  std::map<std::string, std::string> state_of;
  const auto listed = server->get("/v1/jobs").json()["jobs"];
  for (const auto& job : listed) state_of[job["input"]["name"].get<std::string>()] = job["state"].get<std::string>();
  EXPECT_EQ(state_of, (std::map<std::string, std::string>{{"done.obj", "succeeded"}, {"waiting.obj", "queued"}}));
  const auto worker = new_worker();
  for (const auto& job : listed) {
    const std::string id = id_of_job(job);
    EXPECT_EQ(ended(*server, id)["state"], "succeeded");
    EXPECT_FALSE(mesh_of(*server, id).empty());
  }
  EXPECT_THAT(faults_of_shared_store(url_, {}, true), IsEmpty());
}

// CREASED_FORMER_BIN names the creased of the last release, with its creased-postgresql beside it.
TEST_F(SharedStore, AFormerProgramWorksBesideThisOne) {
  const char* const former = std::getenv("CREASED_FORMER_BIN");
  if (former == nullptr) GTEST_SKIP() << "set CREASED_FORMER_BIN to the program of the last release";
  const fs::path port_file = folder_.path() / "port";
  Program former_server({former, "serve", "--store", url_, "--workers", "0", "--port", "0", "--port-file", port_file,
                         "--data-dir", folder_.path() / "former"});
  ASSERT_TRUE(eventually([&] { return fs::exists(port_file) || former_server.ended(); }));
  const int former_port = std::stoi(read_file(port_file));
  const auto server = new_server();  // migrates the tables under the former server
  const auto submitted =
      exchange(former_port, "POST", "/v1/jobs?" + kQuick, {{"Content-Type", "model/obj"}}, small_obj());
  ASSERT_EQ(submitted.status, 202) << submitted.body;
  {
    const auto worker = new_worker();
    EXPECT_EQ(server->wait_for_end(id_of_job(submitted.json()))["state"], "succeeded");
  }
  Program former_worker({former, "worker", "--store", url_, "--data-dir", folder_.path() / "former_worker"});
  const std::string id = id_of_job(server->submit(small_obj(), kQuick + "&seed=2"));
  EXPECT_EQ(server->wait_for_end(id)["state"], "succeeded");
  EXPECT_EQ(exchange(former_port, "GET", "/v1/jobs/" + id).json(), job_at(*server, id));
  EXPECT_THAT(faults_of_shared_store(url_, {}, true), IsEmpty());
}

TEST_F(SharedStore, AProgramWorksOnNewerTablesAsLongAsTheySaySo) {
  { const auto server = new_server(); }
  run_sql(url_, "UPDATE schema_version SET version = 1000");
  {
    const auto server = new_server();
    const auto worker = new_worker();
    EXPECT_EQ(server->wait_for_end(id_of_job(server->submit(small_obj(), kQuick)))["state"], "succeeded");
  }
  run_sql(url_, "UPDATE schema_version SET oldest_program = 1000");
  for (const std::string command : {"serve", "worker"}) {
    const auto refused = run_program({CREASED_BIN, command, "--data-dir", folder_.path() / "data", "--store", url_});
    EXPECT_EQ(refused.exit_code, 1);
    EXPECT_THAT(refused.errors, testing::HasSubstr("programs with version 1000 or later can use")) << command;
  }
}

}  // namespace
}  // namespace crease::test
