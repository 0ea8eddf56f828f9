#include <gmock/gmock.h>

#include <chrono>
#include <fstream>
#include <functional>
#include <utility>
#include <vector>

#include "server/postgresql/postgresql_store.h"
#include "tests/service/shared_store_fixture.h"
#include "tests/support/filled_store.h"
#include "tests/support/store_audit.h"
#include "tests/support/store_support.h"

namespace crease::test {
namespace {

using creased::Claim;
using creased::Store;
using testing::IsEmpty;

/// A shared store in which many jobs have ended or wait: what a call costs does not grow with them.
class SharedGrowth : public SharedStore {
 protected:
  using Call = std::function<void(Store&)>;
  static constexpr std::int64_t kMany = 10'000;
  static constexpr std::int64_t kFew = 300;  // rows of all tables
  static constexpr std::chrono::hours kLease{1};

  void SetUp() override {
    const auto store = open();
    end(*store, submit(*store, "fff"));
  }

  std::unique_ptr<Store> open() const {
    return creased::open_postgresql_store({.url = url_, .data_dir = folder_.path() / "store"});
  }
  static std::string submit(Store& store, const std::string& fingerprint) {
    bool created = false;
    return store.submit(new_job(store, fingerprint, small_obj()), created).id();
  }
  static Claim claimed(Store& store) { return store.claim("worker", kLease).value(); }
  static void end(Store& store, const std::string& id) {
    const Claim claim = claimed(store);
    ASSERT_EQ(claim.job_id, id);
    store.publish_progress(claim, {});
    std::ofstream(store.working_path(claim, creased::file::kResult)) << "result";
    ASSERT_TRUE(store.succeed(claim, {}, {}, {{std::string(creased::file::kResult), 6, "hash"}}));
  }
  void expect_few_rows(const std::string& name, const Call& call) const {
    const auto before = rows_read(url_);
    call(*open());
    EXPECT_LT(rows_read(url_) - before, kFew) << name;
  }
};

TEST_F(SharedGrowth, NoCallPassesOverTheJobsThatHaveEnded) {
  fill_with_ended_jobs(url_, kMany);
  std::vector<std::pair<std::string, Call>> calls = {
      {"submit", [](Store& store) { submit(store, "abc"); }},
      {"claim, progress and end", [](Store& store) { end(store, "abc"); }},
      {"cancel",
       [](Store& store) {
         submit(store, "def");
         store.cancel("def");
       }},
      {"remove", [](Store& store) { EXPECT_TRUE(store.remove("def")); }},
      {"a look for what has expired", [](Store& store) { EXPECT_THAT(store.remove_expired(), IsEmpty()); }},
      {"find and files",
       [](Store& store) {
         EXPECT_TRUE(store.find(id_of_ended_job(7)));
         EXPECT_NE(store.open(id_of_ended_job(8), creased::file::kUpload), nullptr);
         EXPECT_TRUE(store.file_record(id_of_ended_job(8), creased::file::kResult));
         EXPECT_NE(store.version_of(id_of_ended_job(8)), 0U);
       }},
      {"changes",
       [](Store& store) {
         EXPECT_THAT(store.changes_since(store.last_version()), IsEmpty());
         EXPECT_THAT(store.missing({id_of_ended_job(7), "def"}), testing::ElementsAre("def"));
       }},
      {"what servers ask now and then",
       [](Store& store) {
         EXPECT_EQ(store.queued(), 0U);
         EXPECT_EQ(store.longest_wait().count(), 0);
         EXPECT_THAT(store.busy_owners(), IsEmpty());
         EXPECT_THAT(store.busy_workers(), IsEmpty());
         store.lose_all("worker", {});
         store.note_worker("worker", "");
         EXPECT_EQ(store.workers().size(), 1U);
         EXPECT_EQ(store.not_ready_reason(), "");
       }},
  };
  for (const std::string owner : {kLuckyOwner, kUnluckyOwner}) {
    for (const std::string state : {"", "queued", "running", "succeeded", "failed", "cancelled"}) {
      calls.emplace_back("a page of " + state + " jobs of " + owner,
                         [owner, state](Store& store) { store.list(state, 10, "", owner); });
    }
  }
  for (const auto& [name, call] : calls) expect_few_rows(name, call);
}

TEST_F(SharedGrowth, AClaimDoesNotPassOverTheQueue) {
  fill_with_ended_jobs(url_, kMany);
  run_sql(url_, "UPDATE jobs SET state = 'queued', finished = NULL, expires = NULL WHERE seq % 4 = 0");
  run_sql(url_, "VACUUM ANALYZE");
  expect_few_rows("claim and end", [](Store& store) {
    const Claim claim = claimed(store);
    EXPECT_TRUE(store.fail(claim, {}));
    EXPECT_GT(store.longest_wait().count(), 0);
  });
}

// A backup keeps all versions of a row, so a row that every change rewrites would make each slower than the one before.
TEST_F(SharedGrowth, ChangesRewriteNothingButTheirJob) {
  constexpr int kChanges = 200;
  {
    const auto store = open();
    submit(*store, "abc");
    const Claim claim = claimed(*store);
    for (int i = 0; i < kChanges; ++i) store->publish_progress(claim, {});
  }
  EXPECT_GE(rows_rewritten(url_, "jobs"), kChanges);
  for (const std::string table : {"usage", "counting", "workers", "files", "schema_version"}) {
    EXPECT_LT(rows_rewritten(url_, table), kChanges / 10) << table;
  }
}

TEST_F(SharedGrowth, ManyJobsExpireInSmallParts) {
  constexpr std::int64_t kExpired = 1'500, kKept = 500;
  fill_with_ended_jobs(url_, kExpired + kKept);
  run_sql(url_, "UPDATE jobs SET expires = now_ms() - 1 WHERE id BETWEEN '" + id_of_ended_job(1) + "' AND '" +
                    id_of_ended_job(kExpired) + "'");
  std::size_t removed = 0, longest = 0;
  const auto before = rows_read(url_);
  auto store = open();
  EXPECT_TRUE(eventually([&] {
    const auto some = store->remove_expired();
    longest = std::max(longest, some.size());
    return (removed += some.size()) == kExpired;
  }));
  EXPECT_LT(longest, kExpired) << "a server that ends need not wait for all";
  EXPECT_THAT(store->remove_expired(), IsEmpty());
  EXPECT_TRUE(store->find(id_of_ended_job(kExpired + 1)));
  store.reset();
  constexpr std::int64_t kRowsOfAJob = 40;
  EXPECT_LT(rows_read(url_) - before, kRowsOfAJob * kExpired);
  EXPECT_THAT(faults_of_shared_store(url_, {"fff"}), testing::Each(testing::HasSubstr("no whole")))
      << "results of this test are none";
}

}  // namespace
}  // namespace crease::test
