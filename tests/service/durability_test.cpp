#include <gmock/gmock.h>
#include <sys/mount.h>

#include <csignal>
#include <cstdlib>
#include <fstream>
#include <map>
#include <random>

#include "core/base/sanitized.h"
#include "core/measure/noise.h"
#include "tests/service/service_fixture.h"
#include "tests/support/store_audit.h"

namespace crease::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;

const std::vector<std::string> kSmall = {"--workers", "1", "--max-connections", "32", "--max-streams", "8"};

std::vector<std::string> with(std::vector<std::string> flags, const std::vector<std::string>& more) {
  flags.insert(flags.end(), more.begin(), more.end());
  return flags;
}

std::string id_of(const nlohmann::json& job) { return job["id"].get<std::string>(); }

/// A service that can be killed and restarted on the same data directory.
class Durability : public ::testing::Test {
 protected:
  ServerProcess& start(const std::vector<std::string>& flags = {}) {
    server_.reset();
    server_ = std::make_unique<ServerProcess>(with(with(kSmall, {"--data-dir", data_dir().string()}), flags));
    return *server_;
  }
  fs::path data_dir() const { return folder_.path() / "data"; }
  ServerProcess& server() { return *server_; }
  void kill_server() {
    server().signal(SIGKILL);
    server().wait();
  }
  nlohmann::json job(const std::string& id) { return server().get("/v1/jobs/" + id).json(); }
  int sweep_of(const std::string& id) { return job(id)["progress"]["sweep"].get<int>(); }
  bool comes_to_sweep(const std::string& id, int sweep) {
    return eventually([&] { return sweep_of(id) >= sweep; });
  }
  fs::path checkpoint_of(const std::string& id) const { return data_dir() / "jobs" / id / "checkpoint"; }
  /// Waits for a checkpoint of what the job has done so far: the second new one from now. The first may hold less, as
  /// it may have been under way; each is begun once the one before is in its place.
  bool checkpoint_is_renewed(const std::string& id) const {
    const auto written = [&] {
      std::error_code not_yet;
      return fs::last_write_time(checkpoint_of(id), not_yet);
    };
    auto last = written();
    int renewals = 0;
    return eventually([&] {
      const auto now = written();
      renewals += now != last ? 1 : 0;
      last = now;
      return renewals >= 2;
    });
  }
  /// The first sweep that is told of the attempt.
  int first_sweep_of_attempt(const std::string& id, int attempt) {
    int first = 0;
    EXPECT_TRUE(eventually([&] {
      const auto now = job(id);
      first = now["progress"]["sweep"];
      return now["attempt"] == attempt && first > 0;
    }));
    return first;
  }
  void stop_and_audit(const std::set<std::string>& acknowledged) {
    server().signal(SIGTERM);
    EXPECT_EQ(server().wait(), 0);
    EXPECT_THAT(faults_of_store(data_dir(), acknowledged, true), IsEmpty());
  }

  const TemporaryFolder folder_;
  std::unique_ptr<ServerProcess> server_;
};

struct Outcome {
  std::string mesh, labels;
  bool operator==(const Outcome&) const = default;
};

Outcome outcome_of(const ServerProcess& server, const std::string& id) {
  return {server.get("/v1/jobs/" + id + "/mesh?format=ply").body, server.get("/v1/jobs/" + id + "/labels").body};
}

const std::string& noisy_part() {
  static const std::string text = obj_text(add_noise(cube(14), 0.2, 1, NoiseKind::kNormal));
  return text;
}

/// So many sweeps, or as many as take about as long where a sanitizer watches them.
std::string sweeps(int count) {
  constexpr int kSlowerBy = 10;
  return "sweeps=" + std::to_string(kSanitized ? count / kSlowerBy : count);
}

const std::vector<std::string> kRuns = {sweeps(900) + "&threads=1", sweeps(400) + "&process=face&threads=2",
                                        sweeps(300) + "&process=both&curvature_weight=0.2",
                                        sweeps(700) + "&process=vertex"};

std::vector<Outcome> undisturbed() {
  const ServerProcess server(kSmall);
  std::vector<Outcome> outcomes;
  for (const auto& query : kRuns) {
    const std::string id = id_of(server.submit(noisy_part(), query));
    EXPECT_EQ(server.wait_for_end(id)["state"], "succeeded");
    outcomes.push_back(outcome_of(server, id));
  }
  return outcomes;
}

int kills_wanted() {
  // For example 100, by hand.
  const char* given = std::getenv("CREASED_TEST_KILLS");  // NOLINT(concurrency-mt-unsafe): nothing sets variables
  return given == nullptr ? 12 : std::atoi(given);
}

/// Kills parts of the service while jobs run, each time after the running job has made some progress.
class Killer {
 public:
  Killer(unsigned seed, std::function<nlohmann::json()> running_job)
      : random_(seed), running_job_(std::move(running_job)) {}

  /// False: there is no job left to be disturbed. Otherwise whom to kill.
  bool wait_for_a_moment() {
    const auto further = std::uniform_int_distribution<int>(1, kSanitized ? 6 : 60)(random_);
    std::string id;
    int from = -1;
    bool left = true;
    const bool came = eventually([&] {
      const auto job = running_job_();
      left = !job.is_null();
      if (!left) return true;
      if (job["state"] != "running") return false;
      const int sweep = job["progress"]["sweep"];
      if (job["id"] != id) from = -1;
      id = job["id"];
      if (from < 0 && sweep > 0) from = sweep;
      return from >= 0 && sweep >= from + further;
    });
    EXPECT_TRUE(came) << "the service makes no progress";
    return came && left;
  }
  std::string victim() { return std::array<std::string, 4>{"server", "worker", "compute", "task"}.at(random_() % 4); }

 private:
  std::mt19937 random_;
  std::function<nlohmann::json()> running_job_;
};

TEST_F(Durability, JobsWhoseProcessesAreKilledEndWithTheBytesOfAnUndisturbedRun) {
  const std::vector<Outcome> expected = undisturbed();
  const std::vector<std::string> flags = {"--checkpoint-every", "0.02", "--lease", "1"};
  start(flags);
  std::map<std::string, std::size_t> run_of;
  std::set<std::string> acknowledged;
  int killed = 0;
  std::map<std::string, int> killed_kinds;
  const auto submit_all = [&] {
    for (std::size_t run = 0; run < kRuns.size(); ++run) {
      const std::string id = id_of(server().submit(noisy_part(), kRuns[run]));
      run_of[id] = run;
      acknowledged.insert(id);
    }
  };
  Killer killer(static_cast<unsigned>(std::random_device()()), [&]() -> nlohmann::json {
    const auto response = server().get("/v1/jobs?limit=1000");
    if (response.status != 200) return {{"state", "unknown"}};
    nlohmann::json waiting;
    const auto all = response.json();
    for (const auto& job : all["jobs"]) {
      if (job["state"] == "running") return job;
      if (job["state"] == "queued") waiting = job;
    }
    return waiting;
  });
  while (killed < kills_wanted()) {
    if (!killer.wait_for_a_moment()) submit_all();
    if (testing::Test::HasFailure()) break;
    const std::string victim = killer.victim();
    if (victim == "server") {
      kill_server();
      EXPECT_THAT(faults_of_store(data_dir(), acknowledged), IsEmpty());
      start(flags);
    } else {
      const auto processes = processes_below(server().pid(), victim);
      if (processes.empty()) continue;  // it has just ended
      ::kill(processes.front(), SIGKILL);
    }
    ++killed;
    ++killed_kinds[victim];
  }
  std::uint32_t attempts = 0;
  for (const auto& [id, run] : run_of) {
    const auto ended = server().wait_for_state(id, "succeeded");
    EXPECT_EQ(ended["state"], "succeeded") << ended;
    EXPECT_TRUE(outcome_of(server(), id) == expected[run]) << kRuns[run] << " after " << ended["attempt"];
    attempts += ended["attempt"].get<std::uint32_t>();
  }
  EXPECT_GT(attempts, run_of.size()) << "no run was disturbed";
  RecordProperty("kills", killed);
  RecordProperty("attempts", static_cast<int>(attempts));
  stop_and_audit(acknowledged);
}

TEST_F(Durability, AResumedJobDoesNotStartFromTheBeginning) {
  constexpr int kFar = 200;
  start({"--checkpoint-every", "0.02", "--lease", "1"});
  const std::string id = id_of(server().submit(noisy_part(), kLong + "&threads=1"));
  ASSERT_TRUE(comes_to_sweep(id, kFar));
  ASSERT_TRUE(checkpoint_is_renewed(id));
  ::kill(processes_below(server().pid(), "task").at(0), SIGKILL);
  EXPECT_GT(first_sweep_of_attempt(id, 2), kFar);
  exchange(server().port(), "DELETE", "/v1/jobs/" + id);
  EXPECT_TRUE(eventually([&] { return !fs::exists(checkpoint_of(id)); }));
}

TEST_F(Durability, ADrainLeavesACheckpointFromWhichTheNextServerContinues) {
  constexpr int kFar = 100;
  start({"--checkpoint-every", "10000"});
  const std::string id = id_of(server().submit(noisy_part(), kLong + "&threads=1"));
  ASSERT_TRUE(comes_to_sweep(id, kFar));
  server().signal(SIGTERM);
  ASSERT_EQ(server().wait(), 0);
  ASSERT_TRUE(fs::exists(checkpoint_of(id)));
  EXPECT_THAT(faults_of_store(data_dir(), {id}), IsEmpty());
  start();
  EXPECT_GT(first_sweep_of_attempt(id, 1), kFar);
}

TEST_F(Durability, ATornCheckpointIsNotUsed) {
  const std::vector<std::string> flags = {"--checkpoint-every", "10000"};
  const std::string query = sweeps(2000) + "&threads=1";
  std::string id;
  // On a busy machine the job may end before the server is told to stop. Then the test tries again.
  ASSERT_TRUE(eventually([&] {
    start(flags);
    id = id_of(server().submit(noisy_part(), query));
    EXPECT_TRUE(comes_to_sweep(id, 1));
    server().signal(SIGTERM);
    EXPECT_EQ(server().wait(), 0);
    return fs::exists(checkpoint_of(id));
  }));
  fs::resize_file(checkpoint_of(id), fs::file_size(checkpoint_of(id)) / 2);
  start(flags);
  EXPECT_EQ(server().wait_for_end(id)["state"], "succeeded");
  EXPECT_THAT(server().log(), HasSubstr("the checkpoint is damaged"));
  const std::string whole = id_of(server().submit(noisy_part(), query));
  ASSERT_EQ(server().wait_for_end(whole)["state"], "succeeded");
  EXPECT_TRUE(outcome_of(server(), id) == outcome_of(server(), whole));
}

TEST_F(Durability, AcceptedJobsSurviveAKillOfAllProcesses) {
  constexpr int kRounds = 5;
  std::set<std::string> acknowledged;
  for (int round = 0; round < kRounds; ++round) {
    start();
    acknowledged.insert(id_of(server().submit(noisy_part(), "sweeps=5&seed=" + std::to_string(round + 1))));
    kill_server();
    EXPECT_THAT(faults_of_store(data_dir(), acknowledged), IsEmpty());
  }
  start({"--lease", "1"});
  for (const auto& id : acknowledged) EXPECT_EQ(server().wait_for_state(id, "succeeded")["state"], "succeeded") << id;
  stop_and_audit(acknowledged);
}

TEST_F(Durability, ARestartedServerDoesNotWaitForTheLeasesOfDeadWorkers) {
  const std::vector<std::string> flags = {"--lease", "10000", "--checkpoint-every", "0.02"};
  start(flags);
  const std::string id = id_of(server().submit(noisy_part(), "sweeps=600&threads=1"));
  ASSERT_TRUE(comes_to_sweep(id, 10));
  kill_server();
  start(flags);
  EXPECT_EQ(server().wait_for_state(id, "succeeded")["state"], "succeeded");
  stop_and_audit({id});
}

TEST_F(Durability, ACrashingJobFailsAfterThreeAttemptsAndOthersContinue) {
  start({"--checkpoint-every", "10000"});
  const std::string poison = id_of(server().submit(noisy_part(), kLong));
  const std::string other = id_of(server().submit(small_obj(), kQuick));
  for (int attempt = 1; attempt <= 3; ++attempt) {
    std::vector<int> tasks;
    ASSERT_TRUE(eventually([&] {
      tasks = processes_below(server().pid(), "task");
      const auto now = job(poison);
      return now["attempt"] == attempt && now["state"] == "running" && tasks.size() == 1;
    }));
    ::kill(tasks.front(), SIGKILL);
    ASSERT_TRUE(eventually([&] { return job(poison)["attempt"] != attempt || job(poison)["state"] == "failed"; }));
  }
  const auto failed = job(poison);
  EXPECT_EQ(failed["state"], "failed");
  EXPECT_EQ(failed["attempt"], 3);
  EXPECT_EQ(failed["error"]["code"], "worker_lost");
  EXPECT_THAT(failed["error"]["detail"], HasSubstr("attempt 3 was killed by signal 9 (SIGKILL)"));
  EXPECT_EQ(server().wait_for_end(other)["state"], "succeeded");
  stop_and_audit({poison, other});
}

TEST_F(Durability, AJobOverItsTimeLimitFails) {
  start({"--job-cpu-seconds", "1"});
  const std::string id = id_of(server().submit(noisy_part(), kLong));
  const auto failed = server().wait_for_end(id);
  EXPECT_EQ(failed["state"], "failed");
  EXPECT_EQ(failed["attempt"], 3);
  EXPECT_EQ(failed["error"]["code"], "time_limit_exceeded");
  // What a busy machine gives no processor to is ended by the clock on the wall.
  EXPECT_THAT(failed["error"]["detail"],
              testing::AnyOf(HasSubstr("needed more than 1 s of processor time"), HasSubstr("took longer than 4 s")));
  EXPECT_EQ(server().get("/v1/jobs/" + id + "/mesh").code(), "job_failed");
  stop_and_audit({id});
}

TEST_F(Durability, ResultsExpireAndDeletionLeavesNothing) {
  start({"--retention-hours", "12", "--max-retention-hours", "100"});
  const auto soon = server().submit(small_obj(), kQuick + "&retention_hours=0");
  const auto later = server().submit(small_obj(), kQuick);
  EXPECT_EQ(later["parameters"]["retention_hours"], 12);
  const auto schema = server().get("/v1/parameters").json()["properties"]["retention_hours"];
  EXPECT_EQ(schema["default"], 12);
  EXPECT_EQ(schema["maximum"], 100);
  const auto document = server().get("/openapi.json").json();
  EXPECT_EQ(document["components"]["schemas"]["Parameters"]["properties"]["retention_hours"], schema);
  const auto ended = server().wait_for_end(id_of(later));
  EXPECT_EQ(ended["expires_at"].get<std::string>().size(), 24U);
  EXPECT_TRUE(eventually([&] { return server().get("/v1/jobs/" + id_of(soon)).code() == "job_not_found"; }));
  EXPECT_TRUE(eventually([&] { return !fs::exists(data_dir() / "jobs" / id_of(soon)); }));
  EXPECT_EQ(exchange(server().port(), "DELETE", "/v1/jobs/" + id_of(later)).status, 204);
  EXPECT_FALSE(fs::exists(data_dir() / "jobs" / id_of(later)));
  const auto refused =
      exchange(server().port(), "POST", "/v1/jobs?retention_hours=101", {{"Content-Type", "model/obj"}}, small_obj());
  EXPECT_EQ(refused.code(), "parameter_out_of_range");
  EXPECT_EQ(refused.json()["field"], "retention_hours");
  stop_and_audit({});
  for (const auto& entry : fs::directory_iterator(data_dir())) {
    if (!entry.is_regular_file()) continue;
    const std::string digest = later["input"]["sha256"];
    EXPECT_EQ(read_file(entry.path()).find(digest), std::string::npos) << entry.path();
  }
}

TEST_F(Durability, JobsOverTheQuotaAreRefusedBeforeTheDiskIsFull) {
  start({"--quota-mb", "1"});
  std::set<std::string> acknowledged;
  RawResponse refused;
  for (int i = 0; i < 1000 && refused.code().empty(); ++i) {
    refused = exchange(server().port(), "POST", "/v1/jobs?" + kQuick, {{"Content-Type", "model/obj"}}, small_obj());
    if (refused.code().empty()) acknowledged.insert(id_of(refused.json()));
  }
  EXPECT_EQ(refused.status, 507);
  EXPECT_EQ(refused.code(), "quota_exceeded");
  EXPECT_GT(acknowledged.size(), 2U);
  for (const auto& id : acknowledged) EXPECT_EQ(server().wait_for_end(id)["state"], "succeeded");
  const std::string gone = *acknowledged.begin();
  for (const auto& id : acknowledged) exchange(server().port(), "DELETE", "/v1/jobs/" + id);
  EXPECT_EQ(server().submit(small_obj(), kQuick)["state"], "queued");
}

/// A file system of a few megabytes, mounted at the data directory.
class SmallDisk {
 public:
  explicit SmallDisk(fs::path path) : path_(std::move(path)) {
    fs::create_directories(path_);
    mounted_ = ::mount("tmpfs", path_.c_str(), "tmpfs", 0, "size=24m") == 0;
  }
  ~SmallDisk() {
    if (mounted_) ::umount2(path_.c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  bool mounted() const { return mounted_; }
  bool make_read_only() const { return ::mount(nullptr, path_.c_str(), nullptr, MS_REMOUNT | MS_RDONLY, nullptr) == 0; }
  /// Fills the disk.
  void fill() const { std::ofstream(path_ / "ballast", std::ios::app) << std::string(fs::space(path_).available, 'x'); }
  void empty() const { fs::remove(path_ / "ballast"); }

 private:
  fs::path path_;
  bool mounted_ = false;
};

TEST_F(Durability, AFullDiskIsAClearErrorAndLosesNothing) {
  const SmallDisk disk(data_dir());
  if (!disk.mounted()) GTEST_SKIP() << "only root mounts a disk";
  start({"--checkpoint-every", "0.05"});
  const std::string running = id_of(server().submit(noisy_part(), sweeps(3000) + "&threads=1"));
  ASSERT_TRUE(comes_to_sweep(running, 10));
  std::set<std::string> acknowledged = {running};
  const auto submit = [&] {
    auto answer =
        exchange(server().port(), "POST", "/v1/jobs?" + kQuick, {{"Content-Type", "model/obj"}}, noisy_part());
    if (answer.status == 202) acknowledged.insert(id_of(answer.json()));
    return answer;
  };
  RawResponse refused;
  // A checkpoint that takes the place of another one makes room again.
  EXPECT_TRUE(eventually([&] {
    disk.fill();
    refused = submit();
    return refused.status == 507;
  })) << refused.body;
  EXPECT_EQ(refused.code(), "storage_full");
  RawResponse ready;
  EXPECT_TRUE(eventually([&] {
    ready = server().get("/readyz");
    return ready.status == 503;
  }));
  EXPECT_EQ(ready.code(), "store_unavailable");
  EXPECT_THAT(ready.body, testing::AnyOf(HasSubstr("No space left"), HasSubstr("disk")));
  EXPECT_EQ(server().get("/v1/jobs/" + running).status, 200) << "stored data can be read";
  ASSERT_TRUE(eventually([&] {
    disk.fill();
    return server().log().find("No space left") != std::string::npos;
  }));
  EXPECT_THAT(faults_of_store(data_dir(), acknowledged), IsEmpty());

  disk.empty();
  EXPECT_TRUE(eventually([&] { return server().get("/readyz").status == 200; }));
  const auto taken = submit();
  ASSERT_EQ(taken.status, 202) << taken.body;
  for (const auto& id : acknowledged) EXPECT_EQ(server().wait_for_state(id, "succeeded")["state"], "succeeded") << id;
  stop_and_audit(acknowledged);
  server_.reset();
}

TEST_F(Durability, AReadOnlyDataDirectoryIsAClearErrorAtTheStart) {
  const SmallDisk disk(data_dir());
  if (!disk.mounted()) GTEST_SKIP() << "only root mounts a disk";
  ASSERT_TRUE(disk.make_read_only());
  const auto refused = run_program({CREASED_BIN, "serve", "--port", "0", "--data-dir", data_dir().string()});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.errors, HasSubstr("Read-only file system"));
}

}  // namespace
}  // namespace crease::test
