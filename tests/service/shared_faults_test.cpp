#include <fmt/format.h>
#include <gmock/gmock.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <stdexcept>

#include "core/measure/noise.h"
#include "tests/service/shared_store_fixture.h"
#include "tests/support/store_audit.h"

namespace crease::test {
namespace fs = std::filesystem;
namespace {

using testing::IsEmpty;

/// Faults of the database and of the way to it, which take long or need root: `tests/run.sh shared_faults`.
class SharedFaults : public SharedStore {
 protected:
  static constexpr std::chrono::seconds kMinutes{90};

  void SetUp() override {
    if (std::getenv("CREASED_SHARED_FAULTS") == nullptr) GTEST_SKIP() << "tests/run.sh shared_faults";
    if (::geteuid() != 0) GTEST_SKIP() << "root is needed";
  }

  /// Submits a job, again when the store is away. Returns its id.
  static std::string submitted(const ServerProcess& server, int seed) {
    std::string id;
    EXPECT_TRUE(eventually(
        [&] {
          try {
            id = id_of_job(server.submit(part(), fmt::format("sweeps=300&threads=1&seed={}", seed)));
          } catch (const std::runtime_error&) {
            return false;
          }
          return true;
        },
        kMinutes));
    return id;
  }
  static const std::string& part() {
    static const std::string text = obj_text(add_noise(cube(10), 0.2, 1, NoiseKind::kNormal));
    return text;
  }
  /// What a server alone gives for these seeds.
  static std::map<int, std::string> expected(int seeds) {
    const ServerProcess alone({"--store", "sqlite", "--workers", "2"});
    std::map<int, std::string> ids, meshes;
    for (int seed = 1; seed <= seeds; ++seed) ids[seed] = submitted(alone, seed);
    for (const auto& [seed, id] : ids) {
      alone.wait_for_end(id);
      meshes[seed] = mesh_of(alone, id);
    }
    return meshes;
  }
  static bool some_job_runs(const ServerProcess& server) {
    return eventually([&] {
      const auto running = server.get("/v1/jobs?state=running");
      return running.status == 200 && !running.json()["jobs"].empty();
    });
  }
  static std::string one_value(const std::string& url, const std::string& sql) {
    pqxx::connection connection(url);
    return pqxx::nontransaction(connection).exec1(sql)[0].as<std::string>("");
  }
};

TEST_F(SharedFaults, AFailoverToAReplicaLosesNothingAcknowledged) {
  const auto meshes = expected(6);
  PostgresqlServer primary;
  primary.create_database();
  const auto replica = PostgresqlServer::replica_of(primary);
  const std::string both = fmt::format("postgresql://postgres@/test1?host={},{}&target_session_attrs=read-write",
                                       primary.socket_folder(), replica->socket_folder());
  const std::array servers = {new_server(both), new_server(both)};
  std::array<std::unique_ptr<Program>, 4> workers;
  for (auto& worker : workers) worker = new_worker(both);
  std::map<int, std::string> ids;
  for (int seed = 1; seed <= 4; ++seed) ids[seed] = submitted(*servers.at(static_cast<std::size_t>(seed % 2)), seed);
  ASSERT_TRUE(some_job_runs(*servers[0]));
  primary.stop();
  replica->promote();
  for (int seed = 5; seed <= 6; ++seed) ids[seed] = submitted(*servers.at(static_cast<std::size_t>(seed % 2)), seed);
  std::set<std::string> acknowledged;
  for (const auto& [seed, id] : ids) {
    EXPECT_EQ(ended(*servers[0], id)["state"], "succeeded");
    EXPECT_TRUE(mesh_of(*servers[1], id) == meshes.at(seed)) << seed;
    acknowledged.insert(id);
  }
  EXPECT_THAT(faults_of_shared_store(replica->url("test1"), acknowledged), IsEmpty());
}

TEST_F(SharedFaults, ADatabaseWhoseDiskIsFullLosesNothingAcknowledged) {
  const auto meshes = expected(4);
  PostgresqlServer small({.disk_mb = 160});
  const std::string url = small.create_database();
  const auto server = new_server(url);
  const auto worker = new_worker(url), other_worker = new_worker(url);
  std::map<int, std::string> ids;
  for (int seed = 1; seed <= 2; ++seed) ids[seed] = submitted(*server, seed);
  ASSERT_TRUE(some_job_runs(*server));
  const auto filler = small.data_folder() / "filler";
  {
    std::ofstream file(filler, std::ios::binary);
    const std::string piece(1U << 16U, 'x');
    while (file.write(piece.data(), static_cast<std::streamsize>(piece.size())) && file.flush()) {
    }
  }
  std::set<std::string> acknowledged;
  // Small changes may still find a place. What is accepted meanwhile counts as well.
  const std::string large = obj_text(cube(60));
  RawResponse refused;
  EXPECT_TRUE(eventually(
      [&] {
        refused = exchange(server->port(), "POST", "/v1/jobs?sweeps=1", {{"Content-Type", "model/obj"}}, large);
        if (refused.status == 202) acknowledged.insert(id_of_job(refused.json()));
        return refused.status == 507 || refused.status == 503;
      },
      kMinutes))
      << refused.body;
  fs::remove(filler);
  small.stop();  // it may have given up by itself
  small.start();
  for (int seed = 3; seed <= 4; ++seed) ids[seed] = submitted(*server, seed);
  for (const auto& [seed, id] : ids) {
    EXPECT_EQ(ended(*server, id)["state"], "succeeded");
    EXPECT_TRUE(mesh_of(*server, id) == meshes.at(seed)) << seed;
    acknowledged.insert(id);
  }
  EXPECT_THAT(faults_of_shared_store(url, acknowledged), IsEmpty());
}

/// Drops all that goes from and to an address, so that both ends keep a connection that does not exist.
class Cut {
 public:
  explicit Cut(std::string address) : address_(std::move(address)) { all("-I"); }
  ~Cut() { all("-D"); }
  Cut(const Cut&) = delete;
  Cut& operator=(const Cut&) = delete;

 private:
  void all(const std::string& action) const {
    for (const std::string end : {"-s", "-d"}) {
      const auto done = run_program({"/usr/sbin/iptables", action, "INPUT", end, address_, "-p", "tcp", "-j", "DROP"});
      EXPECT_EQ(done.exit_code, 0) << done.errors;
    }
  }
  const std::string address_;
};

TEST_F(SharedFaults, AConnectionThatIsCutHoldsNobodyForLong) {
  const std::string cut_address = fmt::format("127.77.{}.{}", ::getpid() / 250 % 250 + 1, ::getpid() % 250 + 1);
  PostgresqlServer database({.port = 20'000 + ::getpid() % 20'000, .addresses = "127.0.0.1," + cut_address});
  const std::string url = database.create_database();
  const auto through = [&](const std::string& address) {
    return fmt::format("postgresql://postgres@{}:{}/test1", address, 20'000 + ::getpid() % 20'000);
  };
  const auto near = new_server(through("127.0.0.1")), far = new_server(through(cut_address));
  const auto far_worker = new_worker(through(cut_address));
  const std::string id = id_of_job(near->submit(part(), "sweeps=2000&threads=1"));
  near->wait_for_state(id, "running");
  const auto worker = new_worker(through("127.0.0.1"));
  {
    const Cut cut(cut_address);
    const auto started = std::chrono::steady_clock::now();
    EXPECT_TRUE(eventually([&] { return job_at(*near, id).value("attempt", 1) == 2; }, kMinutes)) << "it is taken over";
    const std::chrono::duration<double> until_taken = std::chrono::steady_clock::now() - started;
    const auto away = far->get("/v1/jobs/" + id);
    EXPECT_EQ(away.code(), "store_unavailable");
    const std::chrono::duration<double> until_answer = std::chrono::steady_clock::now() - started;
    RecordProperty("seconds_until_taken_over", std::to_string(until_taken.count()));
    RecordProperty("seconds_until_answer", std::to_string(until_answer.count()));
    fmt::print("taken over after {:.1f} s, a call answered after {:.1f} s\n", until_taken.count(),
               until_answer.count());
    EXPECT_LT(until_answer.count(), 60);
    EXPECT_EQ(ended(*near, id)["state"], "succeeded");
  }
  EXPECT_TRUE(eventually([&] { return far->get("/v1/jobs/" + id).status == 200; }, kMinutes));
  EXPECT_EQ(job_at(*near, id)["attempt"], 2) << "whoever was cut off took nothing back";
  EXPECT_TRUE(mesh_of(*near, id) == mesh_of(*far, id));
  worker->signal(SIGKILL);
  const std::string next = id_of_job(far->submit(small_obj(), kQuick));
  EXPECT_TRUE(eventually([&] { return job_at(*far, next)["state"] == "succeeded"; }, kMinutes))
      << "the worker works again";
  EXPECT_THAT(faults_of_shared_store(url, {id, next}), IsEmpty());
}

TEST_F(SharedFaults, ClocksOfMachinesMayBeMinutesApart) {
  const auto worker_with_clock = [&](const std::string& offset) {
    return std::make_unique<Program>(std::vector<std::string>{
        "/usr/bin/faketime", "--exclude-monotonic", "-f", offset, CREASED_BIN, "worker", "--store", url_, "--data-dir",
        folder_.path() / ("clock" + offset), "--lease", "2", "--checkpoint-every", "0.05"});
  };
  const auto server = new_server();
  const auto before = worker_with_clock("-7m"), after = worker_with_clock("+7m");
  std::set<std::string> ids;
  for (int seed = 1; seed <= 4; ++seed) {
    ids.insert(id_of_job(server->submit(part(), fmt::format("sweeps=1000&threads=1&seed={}", seed))));
  }
  for (const std::string& id : ids) {
    const auto job = ended(*server, id);
    EXPECT_EQ(job["state"], "succeeded");
    EXPECT_EQ(job["attempt"], 1) << "no lease ended early";
  }
  EXPECT_EQ(one_value(url_, "SELECT count(DISTINCT lease_owner) FROM jobs"), "0")
      << "nobody holds a job that has ended";
  EXPECT_EQ(one_value(url_,
                      "SELECT count(*) FROM jobs WHERE NOT (created <= started AND started <= finished"
                      " AND finished <= now_ms() AND created > now_ms() - 300000)"),
            "0");
  EXPECT_THAT(faults_of_shared_store(url_, ids), IsEmpty());
}

}  // namespace
}  // namespace crease::test
