#include "proto/parameter_table.h"
#include "server/store/housekeeper.h"
#include "tests/support/store_fixture.h"

namespace creased::test {
namespace {

constexpr std::uint64_t kMiB = 1U << 20U;

class KeepingTest : public StoreTest {
 protected:
  NewJob request(const std::string& fingerprint, const std::string& owner = {}, double hours = 24) {
    NewJob job = new_job(store(), fingerprint, "upload of " + fingerprint);
    job.owner = owner;
    job.parameters.set_retention_hours(hours);
    return job;
  }
  std::string add(const NewJob& job) {
    bool created = false;
    return store().submit(job, created).id();
  }
  void succeed(const std::string& id) {
    const Claim claim = store().claim("w", kLong).value();
    ASSERT_EQ(claim.job_id, id);
    std::ofstream(store().working_path(claim, file::kResult)) << std::string(kMiB, 'r');
    ASSERT_TRUE(store().succeed(claim, {}, {}, {{std::string(file::kResult), kMiB, "hash"}}));
  }
  /// Keeps a file made from the result of a job.
  bool keep(const std::string& id, const FileRecord& record) {
    const auto made = store().temporary_path();
    std::ofstream(made) << std::string(record.bytes, 'm');
    return store().keep_file(id, record, made);
  }
  std::unique_ptr<Store> with_quota(std::uint64_t bytes) const {
    return open_tested_store({.data_dir = folder_.path() / "data", .quota_bytes = bytes});
  }
  std::int64_t used(const std::string& owner) const {
    SQLite::Database database((folder_.path() / "data" / "creased.db").string());
    SQLite::Statement row(database, "SELECT bytes FROM usage WHERE owner = ?");
    row.bind(1, owner);
    return row.executeStep() ? row.getColumn(0).getInt64() : -1;
  }
  bool row_anywhere(const std::string& text) const {
    for (const auto& entry : fs::directory_iterator(folder_.path() / "data")) {
      if (entry.is_regular_file() && read_file(entry.path()).find(text) != std::string::npos) return true;
    }
    return false;
  }
};

/// What is so of a store in files only.
class DatabaseFileTest : public KeepingTest {};

TEST_F(KeepingTest, AnEndedJobExpiresAfterItsRetentionTimeAndLeavesNothing) {
  add(request("aaa", "", 0));
  add(request("bbb", "", 24));
  EXPECT_FALSE(store().find("aaa").value().has_expires_at()) << "it has not ended";
  EXPECT_THAT(store().remove_expired(), IsEmpty());
  succeed("aaa");
  succeed("bbb");
  EXPECT_EQ(store().find("aaa").value().expires_at(), store().find("aaa").value().finished_at());
  EXPECT_THAT(store().remove_expired(), ElementsAre("aaa"));
  EXPECT_FALSE(store().find("aaa"));
  EXPECT_EQ(content("aaa", file::kResult), std::nullopt);
  EXPECT_TRUE(fs::is_empty(incoming()));
  EXPECT_EQ(content("bbb", file::kResult).value().size(), kMiB);
  EXPECT_GT(store().find("bbb").value().expires_at(), store().find("bbb").value().finished_at());
}

TEST_F(KeepingTest, EveryEndedJobExpires) {
  for (const char* id : {"aaa", "bbb", "ccc", "ddd"}) add(request(id, "", 0));
  store().fail(store().claim("w", kLong).value(), {});
  store().cancel("bbb");
  const Claim claim = store().claim("w", kLong).value();
  store().cancel("ccc");
  store().finish_cancelled(claim);
  const Claim put_back = store().claim("w", kLong).value();
  store().cancel("ddd");
  store().put_back(put_back);
  EXPECT_THAT(store().remove_expired(), testing::UnorderedElementsAre("aaa", "bbb", "ccc", "ddd"));
}

TEST_F(KeepingTest, TheHousekeeperRemovesAndReports) {
  add(request("aaa", "", 0));
  succeed("aaa");
  std::mutex mutex;
  std::vector<std::string> told;
  const Housekeeper keeper(store(), std::chrono::milliseconds(1), [&](const std::string& id) {
    const std::lock_guard lock(mutex);
    told.push_back(id);
  });
  EXPECT_TRUE(eventually([&] {
    const std::lock_guard lock(mutex);
    return told == std::vector<std::string>{"aaa"};
  }));
  EXPECT_FALSE(store().find("aaa"));
}

TEST_F(DatabaseFileTest, AnInterruptedRemovalIsFinishedByTheNextProcess) {
  add(request("aaa"));
  store_.reset();
  {
    // The state after a process was killed between removing the row and the files.
    SQLite::Database database((folder_.path() / "data" / "creased.db").string(), SQLite::OPEN_READWRITE);
    database.exec("DELETE FROM jobs WHERE id = 'aaa'");
  }
  EXPECT_TRUE(fs::exists(job_folder("aaa")));
  store_ = open();
  EXPECT_FALSE(fs::exists(job_folder("aaa")));
  EXPECT_TRUE(fs::is_empty(incoming()));
}

TEST_F(DatabaseFileTest, RemovedDataIsErasedFromTheDatabaseFile) {
  NewJob secret = request("aaa");
  secret.input.set_name("a-very-secret-part.obj");
  add(secret);
  store_.reset();
  ASSERT_TRUE(row_anywhere("a-very-secret-part"));
  EXPECT_TRUE(store().remove("aaa"));
  EXPECT_FALSE(row_anywhere("a-very-secret-part")) << "not in the log either";
}

TEST_F(KeepingTest, JobsOverTheQuotaAreRefusedAndRemovalFreesSpace) {
  const auto bounded = with_quota(1 * kMiB);
  bool created = false;
  std::vector<std::string> ids;
  std::optional<crease::ErrorCode> refusal;
  for (int i = 0; i < 100 && !refusal; ++i) {
    refusal = error_code([&] { ids.push_back(bounded->submit(new_job(*bounded, "abc", "upload"), created).id()); });
  }
  EXPECT_EQ(refusal, code::kQuotaExceeded);
  EXPECT_GT(ids.size(), 1U);
  EXPECT_EQ(bounded->list("", 1000, "").jobs.size(), ids.size()) << "a refused submission leaves nothing";
  EXPECT_TRUE(fs::is_empty(incoming()));
  EXPECT_TRUE(bounded->remove(ids.back()));
  EXPECT_EQ(error_code([&] { bounded->submit(new_job(*bounded, "abc", "upload"), created); }), std::nullopt);
}

TEST_F(DatabaseFileTest, TheBytesOfAJobAreCounted) {
  add(request("aaa", "anna"));
  EXPECT_GT(used("anna"), 0);
  succeed("aaa");
  const auto kept = static_cast<std::int64_t>(kMiB + std::string("upload of aaa").size() +
                                              fs::file_size(file_path("aaa", file::kAccepted)) +
                                              fs::file_size(file_path("aaa", file::kEnd)));
  EXPECT_EQ(used("anna"), kept);
  EXPECT_TRUE(keep("aaa", {"mesh.ply", 1000, "hash"}));
  EXPECT_TRUE(keep("aaa", {"mesh.ply", 1000, "of the same file again"}));
  EXPECT_EQ(used("anna"), kept + 1000);
  EXPECT_FALSE(keep("bbb", {"mesh.ply", 1000, "hash"})) << "no such job";
  EXPECT_EQ(store().file_record("aaa", "mesh.ply").value().sha256, "of the same file again");
  store().remove("aaa");
  EXPECT_EQ(used("anna"), 0);
  store_ = with_quota(2 * kMiB);
  add(request("ccc"));
  succeed("ccc");
  EXPECT_FALSE(keep("ccc", {"mesh.ply", 2 * kMiB, "hash"}));
  EXPECT_TRUE(keep("ccc", {"mesh.ply", kMiB / 2, "hash"}));
}

TEST_F(KeepingTest, OwnersSeeOnlyTheirOwnJobs) {
  add(request("aaa", "anna"));
  add(request("bbb", "bert"));
  EXPECT_TRUE(store().find("aaa", "anna"));
  EXPECT_FALSE(store().find("aaa", "bert"));
  EXPECT_FALSE(store().find("aaa", ""));
  EXPECT_TRUE(store().find("aaa"));
  EXPECT_FALSE(store().cancel("aaa", "bert"));
  EXPECT_EQ(state("aaa"), "queued");
  EXPECT_FALSE(store().remove("aaa", "bert"));
  EXPECT_TRUE(store().find("aaa"));
  const auto ids = [&](const Owner& owner, std::string_view in_state) {
    std::vector<std::string> all;
    for (const auto& job : store().list(in_state, 10, "", owner).jobs) all.push_back(job.id());
    return all;
  };
  EXPECT_THAT(ids("anna", ""), ElementsAre("aaa"));
  EXPECT_THAT(ids("bert", "queued"), ElementsAre("bbb"));
  EXPECT_THAT(ids("", ""), IsEmpty());
  EXPECT_THAT(ids(std::nullopt, ""), ElementsAre("bbb", "aaa"));
  EXPECT_EQ(store().cancel("bbb", "bert").value().state(), "cancelled");
  EXPECT_TRUE(store().remove("bbb", "bert"));
}

TEST_F(KeepingTest, IdempotencyKeysBelongToTheirOwners) {
  bool created = false;
  NewJob first = request("aaa", "anna"), second = request("bbb", "bert");
  first.idempotency_key = second.idempotency_key = "same";
  store().submit(first, created);
  EXPECT_EQ(store().submit(second, created).id(), "bbb");
  EXPECT_TRUE(created);
}

TEST_F(KeepingTest, OwnersHaveTheirOwnLimits) {
  const auto bounded = [this](const std::string& owner, OwnerLimits limits) {
    NewJob job = request("abc", owner);
    job.owner_limits = limits;
    return error_code([&] { add(job); });
  };
  EXPECT_EQ(bounded("anna", {.max_queued = 2}), std::nullopt);
  EXPECT_EQ(bounded("anna", {.max_queued = 2}), std::nullopt);
  EXPECT_EQ(bounded("anna", {.max_queued = 2}), code::kKeyQueueFull);
  EXPECT_EQ(bounded("bert", {.max_queued = 2}), std::nullopt);
  ASSERT_TRUE(store().claim("w", kLong));
  EXPECT_EQ(bounded("anna", {.max_queued = 2}), std::nullopt) << "one of her jobs is running";
  EXPECT_EQ(bounded("anna", {.max_bytes = 100}), code::kQuotaExceeded);
  EXPECT_EQ(bounded("carl", {.max_bytes = kMiB}), std::nullopt);
}

// The schema of version 0.1.0 and a job in the form that it wrote.
constexpr const char* kFirstSchema = R"sql(
  CREATE TABLE change_counter (version INTEGER NOT NULL);
  INSERT INTO change_counter VALUES (7);
  CREATE TABLE jobs (
    seq INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE,
    state TEXT NOT NULL CHECK (state IN ('queued', 'running', 'succeeded', 'failed', 'cancelled')),
    created INTEGER NOT NULL, started INTEGER, finished INTEGER, attempt INTEGER NOT NULL DEFAULT 0,
    lease_owner TEXT, lease_until INTEGER, cancel_requested INTEGER NOT NULL DEFAULT 0, version INTEGER NOT NULL,
    input BLOB NOT NULL, parameters BLOB NOT NULL, warnings BLOB NOT NULL, progress BLOB NOT NULL, result BLOB,
    error BLOB, idempotency_key TEXT UNIQUE, request_digest TEXT NOT NULL);
  CREATE INDEX jobs_by_state ON jobs (state, seq);
  CREATE INDEX jobs_by_version ON jobs (version);
  INSERT INTO jobs VALUES (3, 'aaa', 'succeeded', 1000, 2000, 3000, 1, NULL, 9000, 0, 5, x'', x'', x'', x'', x'', NULL, 'key', 'digest');
  INSERT INTO jobs VALUES (4, 'bbb', 'queued', 1500, NULL, NULL, 0, NULL, NULL, 0, 6, x'', x'', x'', x'', NULL, NULL, NULL, 'other');
  PRAGMA user_version = 1;
)sql";

TEST_F(DatabaseFileTest, ADatabaseOfTheFirstVersionIsMigrated) {
  fs::create_directories(folder_.path() / "data");
  SQLite::Database((folder_.path() / "data" / "creased.db").string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE)
      .exec(kFirstSchema);
  for (const char* id : {"aaa", "bbb"}) fs::create_directories(job_folder(id));
  const v1::Job ended = store().find("aaa").value();
  EXPECT_EQ(ended.state(), "succeeded");
  EXPECT_EQ(ended.created_at(), "1970-01-01T00:00:01.000Z");
  EXPECT_TRUE(ended.has_expires_at());
  EXPECT_THAT(store().remove_expired(), IsEmpty()) << "its retention time starts at the migration";
  EXPECT_EQ(store().queued(), 1U);
  EXPECT_EQ(store().last_version(), 7U);
  NewJob retry = request("ccc");
  retry.idempotency_key = "key";
  retry.request_digest = "digest";
  EXPECT_EQ(add(retry), "aaa");
  EXPECT_EQ(store().claim("w", kLong).value().job_id, "bbb");
  submit("ddd");
  EXPECT_THAT(store().list("", 1, "").jobs.front().id(), "ddd");
}

}  // namespace
}  // namespace creased::test
