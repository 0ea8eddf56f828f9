#include "tests/support/store_fixture.h"

namespace creased::test {
namespace {

TEST_F(StoreTest, ASubmittedJobIsReturnedComplete) {
  NewJob request = new_job(store(), "0123abcd", "bytes");
  request.input.set_faces(7);
  request.warnings.emplace_back().set_code("polygons_triangulated");
  bool created = false;
  const v1::Job job = store().submit(request, created);
  EXPECT_TRUE(created);
  EXPECT_EQ(job.id(), "0123abcd");
  EXPECT_EQ(job.state(), "queued");
  EXPECT_THAT(job.created_at(), MatchesRegex("20..-..-..T..:..:..\\....Z"));
  EXPECT_FALSE(job.has_started_at());
  EXPECT_EQ(job.attempt(), 0U);
  EXPECT_EQ(job.input().SerializeAsString(), request.input.SerializeAsString());
  EXPECT_EQ(job.parameters().SerializeAsString(), request.parameters.SerializeAsString());
  ASSERT_EQ(job.warnings_size(), 1);
  EXPECT_EQ(job.warnings(0).code(), "polygons_triangulated");
  EXPECT_EQ(store().find(job.id()).value().SerializeAsString(), job.SerializeAsString());
  EXPECT_FALSE(fs::exists(request.upload));
  EXPECT_EQ(content(job.id(), file::kUpload), "bytes");
}

TEST_F(StoreTest, WeightsAreStoredWithTheUpload) {
  const auto weighted = [this](const std::string& key) {
    NewJob request = new_job(store(), "abc", "bytes");
    request.idempotency_key = key;
    request.weights = store().temporary_path();
    std::ofstream(request.weights) << "[1, 2]";
    return request;
  };
  bool created = false;
  const NewJob request = weighted("key"), retry = weighted("key");
  const std::string id = store().submit(request, created).id();
  EXPECT_EQ(content(id, file::kWeights), "[1, 2]");
  store().submit(retry, created);
  EXPECT_FALSE(created);
  EXPECT_TRUE(fs::is_empty(incoming()));
  EXPECT_TRUE(store().remove(id));
  EXPECT_EQ(content(id, file::kWeights), std::nullopt);
}

TEST_F(StoreTest, ATakenFingerprintGetsASuffix) {
  EXPECT_EQ(submit("abc").id(), "abc");
  const std::string second = submit("abc").id(), third = submit("abc").id();
  EXPECT_THAT(second, MatchesRegex("abc-[0-9a-f]+"));
  EXPECT_EQ(second.size(), std::string("abc-").size() + 6);
  EXPECT_NE(second, third);
}

TEST_F(StoreTest, AnIdempotentRetryGetsTheFirstJob) {
  NewJob request = new_job(store(), "abc", "bytes");
  request.idempotency_key = "key";
  bool created = false;
  const std::string id = store().submit(request, created).id();
  EXPECT_TRUE(created);
  NewJob retry = new_job(store(), "abc", "bytes");
  retry.idempotency_key = "key";
  EXPECT_EQ(store().submit(retry, created).id(), id);
  EXPECT_FALSE(created);
  EXPECT_FALSE(fs::exists(retry.upload));
  EXPECT_EQ(store().queued(), 1U);

  NewJob other = new_job(store(), "def", "bytes");
  other.idempotency_key = "key";
  EXPECT_EQ(error_code([&] { store().submit(other, created); }), code::kIdempotencyConflict);
  EXPECT_FALSE(fs::exists(other.upload));
}

TEST_F(StoreTest, ConcurrentSubmissionsWithOneKeyMakeOneJob) {
  constexpr int kThreads = 16;
  store();
  std::mutex mutex;
  std::set<std::string> ids;
  int times_created = 0;
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < kThreads; ++i) {
      threads.emplace_back([&] {
        NewJob request = new_job(store(), "abc", "bytes");
        request.idempotency_key = "key";
        bool created = false;
        const std::string id = store().submit(request, created).id();
        const std::lock_guard lock(mutex);
        ids.insert(id);
        times_created += created ? 1 : 0;
      });
    }
  }
  EXPECT_EQ(ids.size(), 1U);
  EXPECT_EQ(times_created, 1);
  EXPECT_EQ(store().list("", 10, "").jobs.size(), 1U);
  EXPECT_TRUE(fs::is_empty(incoming()));
}

TEST_F(StoreTest, TheQueueIsBounded) {
  for (int i = 0; i < 50; ++i) submit("abc");
  EXPECT_EQ(error_code([&] { submit("def"); }), code::kQueueFull);
  EXPECT_FALSE(fs::exists(job_folder("def")));
  ASSERT_TRUE(store().claim("w", kLong));
  EXPECT_EQ(submit("def").id(), "def");
}

TEST_F(StoreTest, JobsAreClaimedInTheOrderOfSubmission) {
  for (const char* id : {"c", "a", "b"}) submit(id);
  std::vector<std::string> order;
  while (const auto claim = store().claim("w", kLong)) order.push_back(claim->job_id);
  EXPECT_THAT(order, ElementsAre("c", "a", "b"));
}

TEST_F(StoreTest, ProcessesAndThreadsNeverClaimAJobTwice) {
  constexpr int kJobs = 40, kProcesses = 3, kThreads = 3;
  for (int i = 0; i < kJobs; ++i) submit("abc");
  store_.reset();
  std::vector<pid_t> processes;
  for (int p = 0; p < kProcesses; ++p) {
    const fs::path log = folder_.path() / ("claims" + std::to_string(p));
    processes.push_back(fork_process([this, log] {
      const auto shared = open();
      std::ofstream out(log);
      std::mutex mutex;
      std::vector<std::jthread> threads;
      for (int t = 0; t < kThreads; ++t) {
        threads.emplace_back([&, t] {
          while (const auto claim = shared->claim("thread" + std::to_string(t), kLong)) {
            const std::lock_guard lock(mutex);
            out << claim->job_id << '\n' << std::flush;
          }
        });
      }
      threads.clear();
      return 0;
    }));
  }
  for (const pid_t process : processes) EXPECT_EQ(wait_for_process(process), 0);
  std::multiset<std::string> claimed;
  for (int p = 0; p < kProcesses; ++p) {
    std::ifstream log(folder_.path() / ("claims" + std::to_string(p)));
    for (std::string id; std::getline(log, id);) claimed.insert(id);
  }
  EXPECT_EQ(claimed.size(), static_cast<std::size_t>(kJobs));
  EXPECT_EQ(std::set<std::string>(claimed.begin(), claimed.end()).size(), claimed.size());
}

TEST_F(StoreTest, AJobWithAnExpiredLeaseIsClaimedByAnotherWorker) {
  submit("abc");
  const Claim first = store().claim("first", kOver).value();
  EXPECT_EQ(first.attempt, 1U);
  const Claim second = store().claim("second", kLong).value();
  EXPECT_EQ(second.job_id, "abc");
  EXPECT_EQ(second.attempt, 2U);
  EXPECT_EQ(store().check(first), Hold::kLost);
  EXPECT_EQ(store().renew(first, kLong), Hold::kLost);
  EXPECT_FALSE(store().succeed(first, {}, {}));
  EXPECT_FALSE(store().fail(first, {}));
  EXPECT_FALSE(store().finish_cancelled(first));
  EXPECT_FALSE(store().put_back(first));
  v1::Progress progress;
  progress.set_sweep(5);
  store().publish_progress(first, progress);
  EXPECT_EQ(store().find("abc").value().progress().sweep(), 0U);
  EXPECT_EQ(store().check(second), Hold::kHeld);
  EXPECT_EQ(state("abc"), "running");
}

TEST_F(StoreTest, ARenewedLeaseHolds) {
  submit("abc");
  const Claim claim = store().claim("w", kOver).value();
  EXPECT_EQ(store().renew(claim, kLong), Hold::kHeld);
  EXPECT_FALSE(store().claim("other", kLong));
  EXPECT_EQ(store().check(claim), Hold::kHeld);
}

TEST_F(StoreTest, AJobReturnedToTheQueueKeepsItsPlaceAndItsAttempts) {
  submit("a");
  submit("b");
  for (int i = 0; i < 5; ++i) {
    const Claim claim = store().claim("w", kLong).value();
    EXPECT_EQ(claim.job_id, "a");
    EXPECT_EQ(claim.attempt, 1U);
    EXPECT_TRUE(store().put_back(claim));
    EXPECT_EQ(state("a"), "queued");
    EXPECT_EQ(store().find("a").value().attempt(), 0U);
    EXPECT_FALSE(store().find("a").value().has_started_at());
  }
}

TEST_F(StoreTest, SuccessStoresResultProgressAndAllWarnings) {
  NewJob request = new_job(store(), "abc", "bytes");
  request.warnings.emplace_back().set_code("one");
  bool created = false;
  store().submit(request, created);
  const Claim claim = store().claim("w", kLong).value();
  v1::ResultFacts result;
  result.set_ridge_edges(12);
  std::vector<v1::Warning> warnings(2);
  warnings[0].set_code("one");
  warnings[1].set_code("two");
  EXPECT_TRUE(store().succeed(claim, result, warnings));
  const v1::Job job = store().find("abc").value();
  EXPECT_EQ(job.state(), "succeeded");
  EXPECT_EQ(job.result().ridge_edges(), 12U);
  EXPECT_EQ(job.progress().fraction(), 1);
  EXPECT_EQ(job.progress().stage(), "done");
  ASSERT_EQ(job.warnings_size(), 2);
  EXPECT_EQ(job.warnings(1).code(), "two");
  EXPECT_FALSE(store().succeed(claim, result, {}));
}

TEST_F(StoreTest, CancelEndsAQueuedJobAtOnceAndAsksTheWorkerOfARunningOne) {
  submit("a");
  submit("b");
  EXPECT_EQ(store().cancel("a").value().state(), "cancelled");
  const Claim claim = store().claim("w", kLong).value();
  EXPECT_EQ(claim.job_id, "b");
  EXPECT_EQ(store().cancel("b").value().state(), "running");
  EXPECT_EQ(store().check(claim), Hold::kCancelRequested);
  EXPECT_EQ(store().renew(claim, kLong), Hold::kCancelRequested);
  EXPECT_TRUE(store().finish_cancelled(claim));
  EXPECT_EQ(state("b"), "cancelled");
  EXPECT_FALSE(store().cancel("c"));
}

TEST_F(StoreTest, CancelLeavesAnEndedJobAsItIs) {
  submit("abc");
  ASSERT_TRUE(store().succeed(store().claim("w", kLong).value(), {}, {}));
  const std::uint64_t version = store().version_of("abc");
  EXPECT_EQ(store().cancel("abc").value().state(), "succeeded");
  EXPECT_EQ(store().version_of("abc"), version);
}

TEST_F(StoreTest, ACancelledJobNeverRunsAgain) {
  submit("a");
  submit("b");
  submit("c");
  const Claim a = store().claim("w", kLong).value(), b = store().claim("w", kOver).value();
  store().cancel("a");
  EXPECT_TRUE(store().put_back(a));
  EXPECT_EQ(state("a"), "cancelled");
  EXPECT_EQ(store().find("a").value().attempt(), 1U);
  EXPECT_EQ(store().cancel("b").value().state(), "cancelled") << "its worker has ended";
  const Claim c = store().claim("w", kLong).value();
  store().cancel("c");
  EXPECT_EQ(store().renew(c, kOver), Hold::kCancelRequested);
  EXPECT_FALSE(store().claim("w", kLong));
  EXPECT_EQ(state("c"), "cancelled");
}

TEST_F(StoreTest, RemovalLeavesNothingAndTheWorkerCannotRestoreIt) {
  submit("abc");
  const Claim claim = store().claim("w", kLong).value();
  std::ofstream open_file(store().working_path(claim, file::kSnapshot));
  store().note_snapshot(claim);
  EXPECT_TRUE(store().remove("abc"));
  EXPECT_FALSE(store().find("abc"));
  EXPECT_EQ(store().version_of("abc"), 0U);
  EXPECT_EQ(store().check(claim), Hold::kLost);
  EXPECT_FALSE(store().succeed(claim, {}, {}));
  EXPECT_TRUE(fs::is_empty(incoming()));
  EXPECT_EQ(content("abc", file::kUpload), std::nullopt);
  EXPECT_FALSE(store().remove("abc"));
  EXPECT_EQ(submit("abc").id(), "abc");
  EXPECT_EQ(store().check(claim), Hold::kLost) << "the new job with that id is a different job";
}

TEST_F(StoreTest, PagesListEveryJobOnceNewestFirst) {
  for (const char* id : {"1", "2", "3", "4", "5"}) submit(id);
  store().cancel("2");
  std::vector<std::string> ids;
  JobPage page;
  do {
    page = store().list("", 2, page.next_cursor);
    EXPECT_LE(page.jobs.size(), 2U);
    for (const auto& job : page.jobs) ids.push_back(job.id());
    submit("6");  // newer jobs do not shift the pages
  } while (!page.next_cursor.empty());
  EXPECT_THAT(ids, ElementsAre("5", "4", "3", "2", "1"));
  const JobPage cancelled = store().list("cancelled", 10, "");
  ASSERT_EQ(cancelled.jobs.size(), 1U);
  EXPECT_EQ(cancelled.jobs.front().id(), "2");
  EXPECT_THAT(cancelled.next_cursor, IsEmpty());
  for (const char* cursor : {"x", "1", "-000000000000001", "0000000000000000", "00000000000000011"}) {
    EXPECT_EQ(error_code([&] { store().list("", 2, cursor); }), crease::code::kParameterInvalid) << cursor;
  }
  EXPECT_EQ(error_code([&] { store().list("done", 2, ""); }), crease::code::kParameterInvalid);
}

TEST_F(StoreTest, EveryChangeOfAJobHasALaterVersion) {
  submit("a");
  submit("b");
  std::uint64_t before = store().last_version();
  const auto expect_change = [&](const std::string& id) {
    const auto changes = store().changes_since(before);
    ASSERT_EQ(changes.size(), 1U);
    EXPECT_EQ(changes[0].job_id, id);
    EXPECT_EQ(changes[0].version, store().version_of(id));
    EXPECT_GT(changes[0].version, before);
    EXPECT_EQ(changes[0].state, state(id));
    before = store().last_version();
  };
  const Claim claim = store().claim("w", kLong).value();
  expect_change("a");
  store().publish_progress(claim, {});
  expect_change("a");
  store().cancel("b");
  expect_change("b");
  store().fail(claim, {});
  expect_change("a");
  store().remove("b");
  EXPECT_GT(store().last_version(), before);
  EXPECT_THAT(store().changes_since(before), IsEmpty());
  EXPECT_THAT(store().missing({"a", "b", "c"}), ElementsAre("b", "c"));
  EXPECT_THAT(store().missing({}), IsEmpty());
}

}  // namespace
}  // namespace creased::test
