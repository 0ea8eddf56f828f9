#include <fmt/format.h>

#include <thread>

#include "tests/support/store_fixture.h"

namespace creased::test {
namespace {

class RemovalTest : public StoreTest {};

TEST_F(RemovalTest, ConcurrentRemovalsDoNotConflict) {
  constexpr int kThreads = 6, kJobs = 25;
  store();
  std::mutex mutex;
  std::vector<std::string> faults;
  const auto work = [&](int thread) {
    for (int i = 0; i < kJobs; ++i) {
      const std::string code = error_code([&] {
        const std::string id = submit(fmt::format("{:020x}", thread * kJobs + i)).id();
        std::ofstream(store().file_path(id, file::kReport)) << "report";
        store().remove(id);
      });
      const std::lock_guard lock(mutex);
      if (code != "no error") faults.push_back(code);
    }
  };
  std::vector<std::thread> threads;
  for (int thread = 0; thread < kThreads; ++thread) threads.emplace_back(work, thread);
  for (auto& thread : threads) thread.join();
  EXPECT_THAT(faults, IsEmpty());
  EXPECT_TRUE(fs::is_empty(incoming()));
}

}  // namespace
}  // namespace creased::test
