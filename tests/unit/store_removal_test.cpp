#include <fmt/format.h>

#include <thread>

#include "tests/support/store_fixture.h"

namespace creased::test {
namespace {

const std::string kId = "00000000000000000abc";

class RemovalTest : public StoreTest {};

TEST_F(RemovalTest, ConcurrentRemovalsDoNotConflict) {
  constexpr int kThreads = 6, kJobs = 25;
  store();
  std::mutex mutex;
  std::vector<crease::ErrorCode> faults;
  const auto work = [&](int thread) {
    for (int i = 0; i < kJobs; ++i) {
      const auto code = error_code([&] {
        const std::string id = submit(fmt::format("{:020x}", thread * kJobs + i)).id();
        std::ofstream(file_path(id, file::kReport)) << "report";
        store().remove(id);
      });
      const std::lock_guard lock(mutex);
      if (code) faults.push_back(*code);
    }
  };
  std::vector<std::thread> threads;
  for (int thread = 0; thread < kThreads; ++thread) threads.emplace_back(work, thread);
  for (auto& thread : threads) thread.join();
  EXPECT_THAT(faults, IsEmpty());
  EXPECT_TRUE(fs::is_empty(incoming()));
}

TEST_F(RemovalTest, AnIdWhoseRemovalIsNotFinishedIsNotTaken) {
  store();
  SQLite::Database database((folder_.path() / "data" / "creased.db").string(), SQLite::OPEN_READWRITE, 10'000);
  database.exec("INSERT INTO removed VALUES ('" + kId +
                "')");  // as a removal leaves it that a failing disk has interrupted
  const std::string id = submit(kId).id();
  EXPECT_NE(id, kId);
  store().remove_expired();
  EXPECT_TRUE(fs::exists(file_path(id, file::kUpload)));
  EXPECT_EQ(submit(kId).id(), kId) << "the removal is finished";
}

// A job with the id of one that was just removed keeps its files, however many finish that removal.
TEST_F(RemovalTest, AnIdThatIsTakenAgainAtOnceKeepsItsFiles) {
  constexpr int kTimes = 300;
  store();
  std::vector<std::jthread> housekeepers;
  for (int i = 0; i < 3; ++i) {
    housekeepers.emplace_back([&](const std::stop_token& ended) {
      while (!ended.stop_requested()) store().remove_expired();
    });
  }
  for (int i = 0; i < kTimes; ++i) {
    const std::string id = submit(kId).id();
    EXPECT_TRUE(store().remove(id));
    const std::string again = submit(kId).id();
    store().remove_expired();
    EXPECT_TRUE(fs::exists(file_path(again, file::kUpload))) << again << ", time " << i;
    store().remove(again);
  }
}

}  // namespace
}  // namespace creased::test
