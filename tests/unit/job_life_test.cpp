#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "core/job.h"
#include "core/measure/samples.h"
#include "proto/convert.h"
#include "proto/parameter_table.h"
#include "server/jobs/life.h"
#include "server/jobs/needs.h"

namespace creased {
namespace code = crease::code;
namespace {

const Loss kCrashed{.what = "was killed"};
const Loss kWithServer{.what = "ended with its server", .with_server = true};
const Loss kOverLimit{.what = "needed too much", .code = code::kMemoryExhausted, .by_limit = true};
constexpr std::uint32_t kThree = 3;

Life running(Life life = {}) { return claimed(std::move(life)); }

TEST(JobState, NamesAreReadAsTheyAreWritten) {
  for (const JobState state : kJobStates) EXPECT_EQ(job_state(name_of(state)), state);
  EXPECT_FALSE(job_state("lost"));
  EXPECT_TRUE(is_terminal("failed"));
  EXPECT_FALSE(is_terminal("queued"));
  EXPECT_FALSE(is_terminal("lost"));
}

TEST(JobLife, EachStepLeadsWhereTheTableSays) {
  Life asked = running();
  asked.cancel_requested = true;
  struct Row {
    const char* what;
    Life after;
    JobState state;
    std::uint32_t attempt;
  };
  const std::vector<Row> rows = {
      {"claimed", running(), JobState::kRunning, 1},
      {"cancelled while queued", cancelled({}), JobState::kCancelled, 0},
      {"cancelled while running", cancelled(running()), JobState::kRunning, 1},
      {"cancelled at its end", cancelled(ended(running(), JobState::kSucceeded)), JobState::kSucceeded, 1},
      {"put back", put_back(running()).life, JobState::kQueued, 0},
      {"put back, to be cancelled", put_back(asked).life, JobState::kCancelled, 1},
      {"deferred", deferred(running(), {code::kStorageFull, "full"}).life, JobState::kQueued, 0},
      {"deferred, to be cancelled", deferred(asked, {code::kStorageFull, "full"}).life, JobState::kCancelled, 1},
      {"lost", lost(running(), kCrashed, kThree).life, JobState::kQueued, 1},
      {"lost, to be cancelled", lost(asked, kCrashed, kThree).life, JobState::kCancelled, 1},
      {"lost at the last attempt", lost(running(), kCrashed, 1).life, JobState::kFailed, 1},
  };
  for (const Row& row : rows) {
    EXPECT_EQ(row.after.state, row.state) << row.what;
    EXPECT_EQ(row.after.attempt, row.attempt) << row.what;
  }
}

/// How many attempts a job has until it fails, if each ends in this way; 0 when it never does.
int attempts_until_failure(const std::function<Transition(const Life&)>& end) {
  Life life;
  for (int attempt = 1; attempt <= 1'000; ++attempt) {
    life = end(claimed(life)).life;
    if (life.state == JobState::kFailed) return attempt;
  }
  return 0;
}

TEST(JobLife, NothingIsRetriedForEver) {
  EXPECT_EQ(attempts_until_failure([](const Life& life) { return lost(life, kCrashed, kThree); }), 3);
  EXPECT_EQ(attempts_until_failure([](const Life& life) { return lost(life, kWithServer, kThree); }), 12);
  EXPECT_EQ(attempts_until_failure([](const Life& life) { return lost(progressed(life), kOverLimit, kThree); }), 3);
  EXPECT_EQ(attempts_until_failure([](const Life& life) { return lost(progressed(life), kCrashed, kThree); }), 100)
      << "progress forgives, but not for ever";
  EXPECT_EQ(attempts_until_failure([](const Life& life) { return deferred(life, {code::kStorageFull, "full"}); }), 100);
  EXPECT_EQ(attempts_until_failure([](const Life& life) { return put_back(life); }), 0) << "workers may stop";
}

TEST(JobLife, AJobThatTheStoreCouldNotKeepWaitsLongerEachTime) {
  Life life;
  std::chrono::milliseconds former{0}, all{0};
  Transition step;
  do {
    step = deferred(claimed(life), {code::kStoreUnavailable, "no disk"});
    life = step.life;
    EXPECT_TRUE(step.wait > former || step.wait == kLongestDeferral || is_terminal(life.state));
    EXPECT_LE(step.wait, kLongestDeferral);
    EXPECT_EQ(life.strikes, 0U) << "the store's own fault costs nothing";
    former = step.wait;
    all += step.wait;
  } while (!is_terminal(life.state));
  EXPECT_GT(all, std::chrono::hours(7));
  EXPECT_EQ(step.error.value().code(), "store_unavailable");
  EXPECT_THAT(step.error->detail(), testing::HasSubstr("no disk"));
  EXPECT_EQ(progressed(life).deferrals, 0U);
}

TEST(JobLife, AFailureNamesEachLostAttempt) {
  Life life;
  Transition step;
  for (const Loss& loss : {kWithServer, kCrashed, kOverLimit, kCrashed}) {
    step = lost(claimed(life), loss, kThree);
    life = step.life;
  }
  EXPECT_EQ(
      step.error.value().detail(),
      "4 attempts in a row were lost: attempt 1 ended with its server; attempt 2 was killed; attempt 3 needed too "
      "much; attempt 4 was killed");
}

TEST(JobNeeds, GrowWithEverythingThatFilesHold) {
  crease::v1::InputFacts input;
  crease::v1::Parameters few, many;
  few.set_sweeps(100);
  many.set_sweeps(500);
  const Needs nothing = needs_of(input, few);
  input.set_vertices(120'000);
  const Needs vertices = needs_of(input, few);
  EXPECT_GT(vertices.file_bytes, nothing.file_bytes + 120'000 * 100) << "vertices without faces have positions, too";
  EXPECT_GT(vertices.disk_bytes, nothing.disk_bytes);
  input.set_faces(1'000);
  EXPECT_GT(needs_of(input, few).disk_bytes, vertices.disk_bytes);
  EXPECT_GT(needs_of(input, many).work, needs_of(input, few).work);
}

TEST(JobNeeds, MemoryGrowsWithTheMeshTheUploadAndTheThreads) {
  constexpr std::uint64_t kMiB = 1U << 20U;
  crease::v1::InputFacts input;
  const crease::v1::Parameters automatic = crease::resolve({});
  crease::v1::Parameters sampler;
  crease::set_parameter(sampler, "solver", "metropolis");
  sampler = crease::resolve(sampler);
  sampler.set_threads(automatic.threads());
  EXPECT_LT(needs_of(input, automatic).memory_bytes, 64 * kMiB + automatic.threads() * 2 * kMiB)
      << "the least that can be set does for a small mesh";
  std::uint64_t before = needs_of(input, automatic).memory_bytes;
  const auto expect_growth = [&] {
    const std::uint64_t now = needs_of(input, automatic).memory_bytes;
    EXPECT_GT(now, before);
    before = now;
  };
  input.set_vertices(500'000);
  expect_growth();
  input.set_faces(1'000'000);
  expect_growth();
  input.set_edges(1'500'000);
  expect_growth();
  EXPECT_GT(before, 1'149 * kMiB) << "what a million faces were seen to need";
  EXPECT_LT(before, 3'000 * kMiB);
  EXPECT_LT(needs_of(input, sampler).memory_bytes, before);
  input.set_bytes(100U << 20U);
  EXPECT_GE(needs_of(input, automatic).memory_bytes, before + 200 * kMiB);
}

// Each method writes what it has come to after every sweep; the largest of these files, twice, has its place.
TEST(JobNeeds, HoldTheCheckpointsAndTheResultsOfEveryMethod) {
  for (const char* solver : {"descent", "metropolis"}) {
    crease::v1::Parameters asked;
    crease::set_parameter(asked, "solver", solver);
    const auto parameters = crease::resolve(asked);
    const auto input = crease::check_mesh(crease::sample_scan());
    std::size_t checkpoint = 0;
    crease::RunContext context;
    context.on_sweep = [&](const crease::SweepView& view) {
      if (view.checkpoint) checkpoint = std::max(checkpoint, view.checkpoint().size());
      return true;
    };
    const auto output = crease::run_job(input, crease::to_options(parameters), context);
    const Needs needs = needs_of(crease::to_message(input.facts), parameters);
    const std::size_t result = crease::to_message(output.result).ByteSizeLong() + 24 * input.mesh.positions.size();
    const std::size_t glb = crease::encode_mesh(output.result, crease::MeshFormat::kGlb).size();
    EXPECT_GT(checkpoint, 0U) << solver;
    EXPECT_LT(checkpoint, needs.file_bytes) << solver;
    EXPECT_LT(2 * checkpoint + result + glb, needs.disk_bytes) << solver;
  }
}

}  // namespace
}  // namespace creased
