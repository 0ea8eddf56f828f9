#include "proto/error_table.h"
#include "tests/support/store_fixture.h"

namespace creased::test {
namespace {

class DataFolderTest : public StoreTest {};

TEST_F(DataFolderTest, NoIdLeavesTheDataDirectory) {
  for (const std::string id : {"", ".", "..", "../abc", "a/b", "/etc", "ABC", "a b", "g", "a\n", "abc.."}) {
    EXPECT_FALSE(JobFiles::valid_id(id)) << id;
    EXPECT_EQ(error_code([&] { store().open(id, file::kResult); }), code::kJobNotFound) << id;
    EXPECT_FALSE(store().find(id)) << id;
    EXPECT_FALSE(store().remove(id)) << id;
    EXPECT_FALSE(store().cancel(id)) << id;
  }
  EXPECT_FALSE(JobFiles::valid_id(std::string(65, 'a')));
  EXPECT_FALSE(JobFiles::valid_id(std::string("a\0b", 3)));
  for (const char* name : {"", "..", ".hidden", "a/b", "../result.pb"}) {
    EXPECT_EQ(error_code([&] { store().open("abc", name); }), code::kJobNotFound) << name;
  }
  EXPECT_EQ(store().working_path({"0af-1", "w", 1}, "result.pb"), job_folder("0af-1") / "result.pb");
}

TEST_F(DataFolderTest, AJobSurvivesAKillRightAfterSubmission) {
  const pid_t process = fork_process([this] {
    submit("abc");
    ::kill(::getpid(), SIGKILL);
    return 0;
  });
  const int status = wait_for_process(process);
  ASSERT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL);
  EXPECT_EQ(state("abc"), "queued");
  EXPECT_EQ(read_file(file_path("abc", file::kUpload)), "upload of abc");
  EXPECT_EQ(store().claim("w", kLong).value().job_id, "abc");
}

TEST_F(DataFolderTest, AnUnusableDataDirectoryIsAnErrorWithItsReason) {
  std::ofstream(folder_.path() / "file") << "no folder";
  try {
    open_store({.data_dir = folder_.path() / "file" / "data"});
    FAIL() << "no error";
  } catch (const crease::Error& error) {
    EXPECT_EQ(error.code(), code::kStoreUnavailable);
    EXPECT_THAT(error.detail(), HasSubstr("Not a directory"));
  }
}

TEST_F(DataFolderTest, AStoreThatCannotWriteIsNotReady) {
  EXPECT_THAT(store().not_ready_reason(), IsEmpty());
  store_.reset();
  const pid_t process = fork_process([this] {
    const auto full = open();
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit nothing{0, 0};
    ::setrlimit(RLIMIT_FSIZE, &nothing);
    const bool not_ready = full->not_ready_reason().find("File too large") != std::string::npos;
    bool created = false;
    const bool refused =
        error_code([&] { full->submit(new_job(*full, "abc", ""), created); }) == code::kStoreUnavailable;
    return not_ready && refused && !full->find("abc") ? 0 : 1;
  });
  EXPECT_EQ(wait_for_process(process), 0);
  EXPECT_FALSE(fs::exists(job_folder("abc")));
}

TEST_F(DataFolderTest, UnknownStoresAreRefused) {
  const auto refusal = [&](const std::string& url) {
    try {
      open_store({.url = url, .data_dir = folder_.path()});
    } catch (const crease::Error& error) {
      return std::string(crease::error_kind(error.code()).name) + ": " + error.detail();
    }
    return std::string();
  };
  EXPECT_THAT(refusal("postgresql://localhost/creased"), HasSubstr("store_unavailable: this program"));
  EXPECT_THAT(refusal("mysql://localhost"), HasSubstr("store_unavailable: unknown store 'mysql://localhost'"));
}

TEST_F(DataFolderTest, ADatabaseOfALaterVersionIsNotChanged) {
  submit("abc");
  store_.reset();
  const fs::path path = folder_.path() / "data" / "creased.db";
  const int present =
      SQLite::Database(path.string(), SQLite::OPEN_READWRITE).execAndGet("PRAGMA user_version").getInt();
  SQLite::Database(path.string(), SQLite::OPEN_READWRITE).exec("PRAGMA user_version = 99");
  EXPECT_EQ(error_code([this] { open(); }), code::kStoreUnavailable);
  SQLite::Database(path.string(), SQLite::OPEN_READWRITE).exec("PRAGMA user_version = " + std::to_string(present));
  EXPECT_EQ(state("abc"), "queued");
}

TEST_F(DataFolderTest, OldLeftoversOfKilledProcessesAreRemoved) {
  submit("abc");
  const fs::path old_upload = store().temporary_path(), new_upload = store().temporary_path();
  for (const fs::path& path : {old_upload, new_upload}) std::ofstream(path) << "half an upl";
  for (const char* id : {"dead", "beef"}) fs::create_directory(job_folder(id));
  const auto long_ago = fs::file_time_type::clock::now() - std::chrono::hours(2);
  for (const fs::path& path : {old_upload, job_folder("dead"), job_folder("abc")}) fs::last_write_time(path, long_ago);
  store_ = open();
  EXPECT_FALSE(fs::exists(old_upload));
  EXPECT_TRUE(fs::exists(new_upload));
  EXPECT_FALSE(fs::exists(job_folder("dead")));
  EXPECT_TRUE(fs::exists(job_folder("beef")));
  EXPECT_EQ(read_file(file_path("abc", file::kUpload)), "upload of abc");
}

TEST_F(DataFolderTest, ManyThreadsShareAFewConnections) {
  constexpr int kThreads = 100, kCalls = 20;
  submit("abc");
  std::atomic<int> found{0};
  {
    std::vector<std::jthread> threads;
    for (int t = 0; t < kThreads; ++t) {
      threads.emplace_back([&] {
        for (int call = 0; call < kCalls; ++call) found += store().find("abc") ? 1 : 0;
      });
    }
  }
  EXPECT_EQ(found, kThreads * kCalls);
  int connections = 0;
  for (const auto& entry : fs::directory_iterator("/proc/self/fd")) {
    std::error_code ignored;
    if (fs::read_symlink(entry.path(), ignored).filename() == "creased.db") ++connections;
  }
  EXPECT_LE(connections, 6);
  EXPECT_GE(connections, 1);
}

}  // namespace
}  // namespace creased::test
