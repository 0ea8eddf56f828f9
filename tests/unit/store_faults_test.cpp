#include <fmt/format.h>
#include <sys/stat.h>

#include "crease/v1/result.pb.h"
#include "proto/convert.h"
#include "proto/parameter_table.h"
#include "tests/support/store_fixture.h"

namespace creased::test {
namespace {

const crease::Error kSick{code::kStoreUnavailable, "the disk is sick"};

/// A store whose files and database are cut, lost and bent.
class StoreFaultsTest : public StoreTest {
 protected:
  std::unique_ptr<Store> recovered(Orphans orphans = Orphans::kRefuse) {
    store_.reset();
    StoreOptions options;
    options.data_dir = data_dir();
    options.recover = true;
    options.orphans = orphans;
    return open_store(options);
  }
  fs::path data_dir() const { return folder_.path() / "data"; }
  fs::path database() const { return data_dir() / "creased.db"; }
  NewJob job_of(const std::string& id, const std::string& owner, std::uint32_t faces = 4) {
    NewJob job = new_job(store(), id, "upload of " + id);
    job.owner = owner;
    job.input.set_faces(faces);
    job.input.set_vertices(faces);
    return job;
  }
  void add(const std::string& id, const std::string& owner, std::uint32_t faces = 4) {
    bool created = false;
    store().submit(job_of(id, owner, faces), created);
  }
  std::string claimed_id() {
    const auto claim = store().claim("w", kLong);
    return claim ? claim->job_id : "";
  }
};

TEST_F(StoreFaultsTest, AJobThatWasPutBackByAFaultWaitsAndLetsOthersPass) {
  submit("aaa");
  submit("bbb");
  const Claim first = store().claim("w", kLong).value();
  ASSERT_EQ(first.job_id, "aaa");
  EXPECT_TRUE(store().defer(first, kSick));
  EXPECT_EQ(state("aaa"), "queued");
  EXPECT_EQ(store().find("aaa")->attempt(), 0U);
  EXPECT_EQ(claimed_id(), "bbb");
  EXPECT_EQ(claimed_id(), "") << "it waits";
  EXPECT_TRUE(eventually([&] { return claimed_id() == "aaa"; })) << "but not for ever";
}

TEST_F(StoreFaultsTest, EveryOwnerGetsItsShare) {
  for (int i = 0; i < 40; ++i) add(fmt::format("aa{:02}", i), "anna");
  add("bbb", "bert");
  const std::string first = claimed_id();
  EXPECT_EQ(first, "aa00");
  EXPECT_EQ(claimed_id(), "bbb") << "anna's other jobs wait for bert's first one";
  EXPECT_EQ(claimed_id(), "aa01");
}

TEST_F(StoreFaultsTest, SmallJobsPassLargeOnes) {
  add("aaa", "anna", 4'000'000);
  add("bbb", "anna");
  EXPECT_EQ(claimed_id(), "bbb");
  EXPECT_EQ(claimed_id(), "aaa");
}

TEST_F(StoreFaultsTest, ADatabaseThatIsGoneIsNotBegunAnewBesideOldFiles) {
  add("aaa", "anna");
  store_.reset();
  fs::remove(database());
  for (const char* part : {"-wal", "-shm"}) fs::remove(database().string() + part);
  EXPECT_EQ(error_code([&] { open(); }), code::kStoreUnavailable);
  EXPECT_EQ(error_code([&] { recovered(); }), code::kStoreUnavailable);
  EXPECT_FALSE(fs::exists(database()));
  EXPECT_TRUE(fs::exists(job_folder("aaa") / "upload"));

  store_ = recovered(Orphans::kAdopt);
  const v1::Job job = store().find("aaa", "anna").value();
  EXPECT_EQ(job.state(), "queued");
  EXPECT_EQ(job.input().name(), "part.obj");
  bool created = true;
  EXPECT_EQ(claimed_id(), "aaa");
  store().submit(job_of("aaa", "anna"), created);
  EXPECT_TRUE(created) << "without an idempotency key it is another job";
}

TEST_F(StoreFaultsTest, AnAdoptedJobKeepsItsResultOnlyIfThatIsAsItWasWritten) {
  for (const std::string id : {"aaa", "bbb", "ccc"}) {
    submit(id);
    const Claim claim = store().claim("w", kLong).value();
    crease::v1::Report report;
    report.set_id(id);
    std::vector<FileRecord> files;
    for (const auto& [name, bytes] : {std::pair{file::kResult, std::string("result of ") + id},
                                      std::pair{file::kReport, report.SerializeAsString()}}) {
      std::ofstream(file_path(id, name)) << bytes;
      files.push_back({std::string(name), bytes.size(), crease::sha256_hex(bytes)});
    }
    ASSERT_TRUE(store().succeed(claim, {}, {}, files));
  }
  fs::resize_file(file_path("bbb", file::kResult), 5);
  std::ofstream(file_path("ccc", file::kResult)) << "RESULT OF ccc";
  store_.reset();
  fs::remove(database());
  store_ = recovered(Orphans::kAdopt);
  EXPECT_EQ(state("aaa"), "succeeded");
  EXPECT_EQ(state("bbb"), "queued") << "it runs again";
  EXPECT_EQ(state("ccc"), "queued") << "nothing that is wrong is taken for right";
  EXPECT_EQ(store().file_record("aaa", file::kResult).value().sha256, crease::sha256_hex("result of aaa"));
}

TEST_F(StoreFaultsTest, OldFilesAreDiscardedOnDemand) {
  submit("aaa");
  store_.reset();
  fs::remove(database());
  store_ = recovered(Orphans::kDiscard);
  EXPECT_FALSE(store().find("aaa"));
  EXPECT_FALSE(fs::exists(job_folder("aaa")));
}

TEST_F(StoreFaultsTest, JobsThatTheDatabaseHasForgottenComeBack) {
  submit("aaa");
  store_.reset();
  fs::copy_file(database(), folder_.path() / "earlier");
  submit("bbb");
  store_.reset();
  // As if the log had been cut: the database is as it was before the second job.
  fs::copy_file(folder_.path() / "earlier", database(), fs::copy_options::overwrite_existing);
  store_ = recovered();
  EXPECT_EQ(state("aaa"), "queued");
  EXPECT_EQ(state("bbb"), "queued");
  EXPECT_TRUE(store().remove("bbb"));
  store_ = recovered();
  EXPECT_FALSE(store().find("bbb")) << "what was deleted stays deleted";
}

TEST_F(StoreFaultsTest, ADamagedDatabaseCostsNoJob) {
  for (int i = 0; i < 48; ++i) submit(fmt::format("a{:03}", i));
  store_.reset();
  constexpr std::uint64_t kPage = 4096;
  const auto pages = fs::file_size(database()) / kPage;
  ASSERT_GT(pages, 10U);
  for (const std::uint64_t page : {pages / 4, pages / 2, 3 * pages / 4}) {
    std::fstream file(database(), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(static_cast<std::streamoff>(page * kPage));
    file << std::string(kPage, '\x5a');
  }
  store_ = recovered();
  for (int i = 0; i < 48; ++i) {
    const std::string id = fmt::format("a{:03}", i);
    ASSERT_TRUE(store().find(id)) << id;
    EXPECT_EQ(state(id), "queued") << id;
  }
  EXPECT_EQ(store().list("", 300, "").jobs.size(), 48U);
}

TEST_F(StoreFaultsTest, ADamagedRowDoesNotHideTheOthers) {
  submit("aaa");
  submit("bbb");
  store_.reset();
  SQLite::Database(database().string(), SQLite::OPEN_READWRITE)
      .exec("UPDATE jobs SET input = x'ffffffff' WHERE id = 'aaa'");
  const auto page = store().list("", 10, "");
  ASSERT_EQ(page.jobs.size(), 2U);
  EXPECT_EQ(page.jobs[0].state(), "queued");
  EXPECT_EQ(page.jobs[1].state(), "failed");
  EXPECT_THAT(page.jobs[1].error().detail(), HasSubstr("damaged"));
}

TEST_F(StoreFaultsTest, TheDataFolderIsPrivate) {
  fs::create_directory(data_dir());
  fs::permissions(data_dir(), fs::perms::all);
  submit("aaa");
  struct stat status {};
  ASSERT_EQ(::stat(data_dir().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0700U);
}

TEST_F(StoreFaultsTest, ExpiryMovesWithAClockThatWasSet) {
  submit("aaa");
  ASSERT_TRUE(store().succeed(store().claim("w", kLong).value(), {}, {}));
  store().remove_expired();
  const std::string before = store().find("aaa")->expires_at();
  // A clock that was two days behind until now: what the store remembers of it differs from what it shows.
  SQLite::Database(database().string(), SQLite::OPEN_READWRITE, 10'000)
      .exec("UPDATE clock SET offset = offset - 172800000");
  EXPECT_THAT(store().remove_expired(), IsEmpty());
  EXPECT_GT(store().find("aaa")->expires_at(), before);
  const std::string after = store().find("aaa")->expires_at();
  store().remove_expired();
  EXPECT_EQ(store().find("aaa")->expires_at(), after) << "one step moves it once";
}

TEST_F(StoreFaultsTest, AWorkerThatCannotWorkIsKnown) {
  store().note_worker("w", "no disk");
  ASSERT_EQ(store().workers().size(), 1U);
  EXPECT_EQ(store().workers()[0].problem, "no disk");
  store().note_worker("w", "");
  ASSERT_EQ(store().workers().size(), 1U);
  EXPECT_EQ(store().workers()[0].problem, "");
  EXPECT_LT(store().workers()[0].age, std::chrono::minutes(10));
}

}  // namespace
}  // namespace creased::test
