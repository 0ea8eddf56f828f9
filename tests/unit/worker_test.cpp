#include "server/worker/worker.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <atomic>
#include <csignal>
#include <fstream>
#include <thread>

#include "core/error.h"
#include "core/job.h"
#include "crease/v1/result.pb.h"
#include "proto/convert.h"
#include "proto/parameter_table.h"
#include "tests/support/meshes.h"
#include "tests/support/server_process.h"
#include "tests/support/store_support.h"

namespace creased {
namespace code = crease::code;
namespace {

namespace fs = std::filesystem;
namespace v1 = crease::v1;
using crease::test::eventually;
using crease::test::fork_process;
using crease::test::new_job;
using crease::test::obj_text;
using crease::test::read_file;
using crease::test::wait_for_process;

constexpr std::uint32_t kFew = 5, kEndless = 100'000;
constexpr std::chrono::milliseconds kShortLease{300};

v1::Parameters sweeps(std::uint32_t count) {
  v1::Parameters parameters;
  parameters.set_sweeps(count);
  parameters.set_threads(1);
  return parameters;
}

WorkerOptions quick(const std::string& name) {
  using std::chrono::milliseconds;
  WorkerOptions options;
  options.executable = CREASED_BIN;
  options.name = name;
  options.poll = milliseconds(1);
  options.progress_every = milliseconds(1);
  options.snapshot_every = milliseconds(5);
  options.checkpoint_every = milliseconds(5);
  return options;
}

/// A worker that runs in a thread of this process.
class Worker {
 public:
  explicit Worker(Store& store, const WorkerOptions& options = quick("worker"))
      : thread_([this, &store, options] { exit_code_ = run_worker(store, options, stop_); }) {}
  ~Worker() { stop(); }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  int stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
    return exit_code_;
  }

 private:
  std::atomic<bool> stop_{false};
  int exit_code_ = -1;
  std::thread thread_;
};

class WorkerTest : public testing::Test {
 protected:
  std::unique_ptr<Store> open() const {
    StoreOptions options;
    options.data_dir = folder_.path();
    return open_store(options);
  }
  Store& store() {
    if (!store_) store_ = open();
    return *store_;
  }
  void submit(const std::string& id, const std::string& upload, const v1::Parameters& parameters) {
    bool created = false;
    store().submit(new_job(store(), id, upload, parameters), created);
  }
  v1::Job job(const std::string& id) { return store().find(id).value(); }
  bool reaches(const std::string& id, const std::string& state) {
    return eventually([&] { return job(id).state() == state; });
  }
  bool is_sweeping(const std::string& id) {
    return eventually([&] { return job(id).progress().sweep() > 0; });
  }
  fs::path file_of(const std::string& id, std::string_view name) { return folder_.path() / "jobs" / id / name; }

  const crease::test::TemporaryFolder folder_;
  std::unique_ptr<Store> store_;
};

std::string bytes_of_run_in_process(const std::string& upload, std::uint32_t count) {
  const auto input = crease::check_input(upload, crease::MeshFormat::kObj);
  crease::RunContext context;
  const auto output = crease::run_job(input, crease::to_options(crease::resolve(sweeps(count))), context);
  auto message = crease::to_message(output.result);
  for (const crease::Vec3& position : input.mesh.positions) {
    for (const double coordinate : position) message.add_measured(coordinate);
  }
  return message.SerializeAsString();
}

TEST_F(WorkerTest, AJobGivesTheResultOfALocalRun) {
  const std::string upload = obj_text(crease::test::cube(4));
  submit("abc", upload, sweeps(kFew));
  Worker worker(store());
  ASSERT_TRUE(reaches("abc", "succeeded"));
  EXPECT_EQ(worker.stop(), 0);
  EXPECT_EQ(read_file(file_of("abc", file::kResult)), bytes_of_run_in_process(upload, kFew));
  const v1::Job done = job("abc");
  EXPECT_EQ(done.attempt(), 1U);
  EXPECT_EQ(done.progress().sweep(), kFew);
  EXPECT_EQ(done.progress().fraction(), 1);
  EXPECT_LE(done.created_at(), done.started_at());
  EXPECT_LE(done.started_at(), done.finished_at());
  EXPECT_GT(done.result().seconds(), 0);
}

TEST_F(WorkerTest, AJobWithMissingWeightsFails) {
  bool created = false;
  auto request = new_job(store(), "abc", obj_text(crease::test::cube(4)), sweeps(kFew));
  request.input.set_weights_sha256("of weights that are not there");
  store().submit(request, created);
  const Worker worker(store());
  ASSERT_TRUE(reaches("abc", "failed"));
  EXPECT_EQ(job("abc").error().code(), "upload_damaged");
}

TEST_F(WorkerTest, TheReportDescribesTheRun) {
  submit("abc", obj_text(crease::test::cube(4)), sweeps(kFew));
  const Worker worker(store());
  ASSERT_TRUE(reaches("abc", "succeeded"));
  v1::Report report;
  ASSERT_TRUE(report.ParseFromString(read_file(file_of("abc", file::kReport))));
  EXPECT_EQ(report.id(), "abc");
  EXPECT_EQ(report.version(), CREASE_VERSION);
  EXPECT_EQ(report.sweeps_size(), static_cast<int>(kFew));
  EXPECT_EQ(report.input().SerializeAsString(), job("abc").input().SerializeAsString());
  EXPECT_EQ(report.parameters().SerializeAsString(), job("abc").parameters().SerializeAsString());
  EXPECT_EQ(report.result().SerializeAsString(), job("abc").result().SerializeAsString());
  EXPECT_GE(report.timings().queued_seconds(), 0);
  EXPECT_GT(report.timings().decode_seconds(), 0);
  EXPECT_GT(report.timings().smooth_seconds(), 0);
}

TEST_F(WorkerTest, CancellingStopsARunningJobBetweenSweeps) {
  submit("abc", obj_text(crease::test::cube(8)), sweeps(kEndless));
  const Worker worker(store());
  ASSERT_TRUE(is_sweeping("abc"));
  EXPECT_EQ(store().cancel("abc").value().state(), "running");
  ASSERT_TRUE(reaches("abc", "cancelled"));
  EXPECT_LT(job("abc").progress().sweep(), kEndless);
  EXPECT_FALSE(fs::exists(file_of("abc", file::kResult)));
}

TEST_F(WorkerTest, AStoppedWorkerReturnsItsJobToTheQueue) {
  submit("abc", obj_text(crease::test::cube(8)), sweeps(kEndless));
  Worker worker(store());
  ASSERT_TRUE(is_sweeping("abc"));
  EXPECT_EQ(worker.stop(), 0);
  EXPECT_EQ(job("abc").state(), "queued");
  EXPECT_EQ(job("abc").attempt(), 0U);
  EXPECT_EQ(job("abc").progress().sweep(), 0U);
}

TEST_F(WorkerTest, ARemovedJobIsAbandonedAndTheNextOneRuns) {
  submit("abc", obj_text(crease::test::cube(8)), sweeps(kEndless));
  const Worker worker(store());
  ASSERT_TRUE(is_sweeping("abc"));
  EXPECT_TRUE(store().remove("abc"));
  submit("def", obj_text(crease::test::cube(2)), sweeps(kFew));
  ASSERT_TRUE(reaches("def", "succeeded"));
  EXPECT_FALSE(store().find("abc"));
  EXPECT_FALSE(fs::exists(file_of("abc", "upload").parent_path()));
}

TEST_F(WorkerTest, ALongJobKeepsItsLease) {
  submit("abc", obj_text(crease::test::cube(8)), sweeps(kEndless));
  WorkerOptions options = quick("worker");
  options.lease = kShortLease;
  const Worker worker(store(), options);
  ASSERT_TRUE(is_sweeping("abc"));
  const auto lease_until = [this] {
    const SQLite::Database database((folder_.path() / "creased.db").string(), SQLite::OPEN_READONLY, 10'000);
    SQLite::Statement row(database, "SELECT lease_until FROM jobs WHERE id = 'abc'");
    return row.executeStep() ? row.getColumn(0).getInt64() : 0;
  };
  for (int renewal = 1; renewal <= 3; ++renewal) {
    const auto before = lease_until();
    EXPECT_TRUE(eventually([&] { return lease_until() > before; })) << renewal;
  }
}

TEST_F(WorkerTest, AJobOfAKilledWorkerRunsAgainAndGivesTheSameBytes) {
  constexpr std::uint32_t kSome = 400;
  const std::string upload = obj_text(crease::test::cube(12));
  WorkerOptions options = quick("first");
  options.lease = kShortLease;
  // A machine may be so busy that the job ends before its worker is killed: then it is for another one.
  ASSERT_TRUE(eventually([&] {
    store().remove("abc");
    submit("abc", upload, sweeps(kSome));
    store_.reset();
    const pid_t process = fork_process([&] {
      const std::atomic<bool> never{false};
      return run_worker(*open(), options, never);
    });
    EXPECT_TRUE(is_sweeping("abc"));
    ::kill(process, SIGKILL);
    EXPECT_TRUE(WIFSIGNALED(wait_for_process(process)));
    return job("abc").state() == "running";
  }));
  std::ofstream(file_of("abc", "result.pb.1.part")) << "half a res";
  const Worker second(store(), quick("second"));
  ASSERT_TRUE(reaches("abc", "succeeded"));
  EXPECT_EQ(job("abc").attempt(), 2U);
  EXPECT_EQ(read_file(file_of("abc", file::kResult)), bytes_of_run_in_process(upload, kSome));
  EXPECT_FALSE(fs::exists(file_of("abc", "result.pb.1.part")));
}

TEST_F(WorkerTest, ARunningJobHasSnapshotsAndAnEndedOneHasNone) {
  const crease::Mesh mesh = crease::test::cube(8);
  submit("abc", obj_text(mesh), sweeps(kEndless));
  const Worker worker(store());
  ASSERT_TRUE(eventually([&] { return fs::exists(file_of("abc", file::kSnapshot)); }));
  v1::LabelledMesh snapshot;
  ASSERT_TRUE(snapshot.ParseFromString(read_file(file_of("abc", file::kSnapshot))));
  EXPECT_EQ(snapshot.positions_size(), static_cast<int>(3 * mesh.positions.size()));
  EXPECT_EQ(snapshot.triangles_size(), static_cast<int>(3 * mesh.triangles.size()));
  EXPECT_EQ(snapshot.edges_size(), 2 * snapshot.labels_size());
  EXPECT_EQ(snapshot.dihedral_rad_size(), snapshot.labels_size());
  store().cancel("abc");
  ASSERT_TRUE(reaches("abc", "cancelled"));
  EXPECT_TRUE(eventually([&] { return !fs::exists(file_of("abc", file::kSnapshot)); }));
}

TEST_F(WorkerTest, AnInvalidUploadFailsWithItsCodeAndTheWorkerContinues) {
  submit("bad", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", sweeps(kFew));
  submit("abc", obj_text(crease::test::cube(2)), sweeps(kFew));
  const Worker worker(store());
  ASSERT_TRUE(reaches("abc", "succeeded"));
  const v1::Job bad = job("bad");
  EXPECT_EQ(bad.state(), "failed");
  EXPECT_EQ(bad.error().code(), "mesh_index_out_of_range");
  EXPECT_EQ(bad.error().place(), "face 0");
  EXPECT_EQ(bad.attempt(), 1U);
}

TEST(WorkerName, RecognisesDeadWorkersOfThisHost) {
  const pid_t gone = fork_process([] { return 0; });
  EXPECT_TRUE(eventually([&] { return is_dead_worker(worker_name(gone)); })) << "before it is reaped";
  wait_for_process(gone);
  EXPECT_TRUE(is_dead_worker(worker_name(gone)));
  EXPECT_FALSE(is_dead_worker(worker_name(::getpid())));
  EXPECT_FALSE(is_dead_worker("elsewhere-" + std::to_string(gone)));
  EXPECT_FALSE(is_dead_worker(worker_name(gone) + "x"));
  EXPECT_FALSE(is_dead_worker(""));
}

TEST_F(WorkerTest, SeveralWorkersShareTheQueue) {
  constexpr int kJobs = 12;
  std::vector<std::string> ids;
  bool created = false;
  const std::string upload = obj_text(crease::test::cube(3));
  for (int i = 0; i < kJobs; ++i) {
    ids.push_back(store().submit(new_job(store(), "abc", upload, sweeps(kFew)), created).id());
  }
  const Worker first(store(), quick("first")), second(store(), quick("second"));
  for (const auto& id : ids) {
    ASSERT_TRUE(reaches(id, "succeeded"));
    EXPECT_EQ(job(id).attempt(), 1U);
    EXPECT_EQ(read_file(file_of(id, file::kResult)), read_file(file_of(ids.front(), file::kResult)));
  }
}

}  // namespace
}  // namespace creased
