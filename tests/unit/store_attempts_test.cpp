#include "tests/support/store_fixture.h"

namespace creased::test {
namespace {

const Loss kCrash{.what = "was killed by signal 11 (SIGSEGV)"};
const Loss kOutOfTime{
    .what = "needed more than 5 s of processor time", .code = code::kTimeLimitExceeded, .by_limit = true};

class AttemptsTest : public StoreTest {
 protected:
  Claim claim(const std::string& worker = "w") { return store().claim(worker, kLong).value(); }
  void write_checkpoint(const Claim& claim) {
    std::ofstream(store().working_path(claim, file::kCheckpoint)) << "state of attempt " << claim.attempt;
    store().note_checkpoint(claim);
  }
  v1::Job job(const std::string& id = "abc") { return store().find(id).value(); }
};

TEST_F(AttemptsTest, ALostJobIsQueuedAgainAndFailsAfterThreeAttempts) {
  submit("abc");
  for (std::uint32_t attempt = 1; attempt <= 3; ++attempt) {
    EXPECT_EQ(state("abc"), "queued");
    const Claim held = claim();
    EXPECT_EQ(held.attempt, attempt);
    EXPECT_TRUE(store().lose(held, attempt == 2 ? Loss{.what = "was killed by signal 9 (SIGKILL)"} : kCrash));
    EXPECT_EQ(store().check(held), Hold::kLost);
    EXPECT_FALSE(store().lose(held, kCrash)) << "the attempt is already lost";
  }
  EXPECT_FALSE(store().claim("w", kLong));
  EXPECT_EQ(job().state(), "failed");
  EXPECT_EQ(job().attempt(), 3U);
  EXPECT_EQ(job().error().code(), "worker_lost");
  EXPECT_EQ(job().error().detail(),
            "3 attempts in a row were lost: attempt 1 was killed by signal 11 (SIGSEGV); attempt 2 was killed by "
            "signal 9 (SIGKILL); attempt 3 was killed by signal 11 (SIGSEGV)");
  EXPECT_TRUE(job().has_finished_at());
  EXPECT_TRUE(job().has_expires_at());
}

TEST_F(AttemptsTest, AJobWhoseLeaseExpiresThreeTimesFails) {
  submit("abc");
  for (std::uint32_t attempt = 1; attempt <= 3; ++attempt) {
    EXPECT_EQ(store().claim("w", kOver).value().attempt, attempt);
  }
  EXPECT_FALSE(store().claim("w", kLong));
  EXPECT_EQ(job().state(), "failed");
  EXPECT_EQ(job().error().code(), "worker_lost");
  EXPECT_THAT(job().error().detail(), HasSubstr("3 attempts in a row were lost: attempt 1 stopped responding"));
}

TEST_F(AttemptsTest, AttemptsThatMakeProgressDoNotCount) {
  submit("abc");
  for (std::uint32_t attempt = 1; attempt <= 10; ++attempt) {
    const Claim held = claim();
    write_checkpoint(held);
    EXPECT_TRUE(store().lose(held, kCrash));
    EXPECT_EQ(state("abc"), "queued");
    EXPECT_EQ(job().attempt(), attempt);
  }
  store().lose(claim(), kCrash);
  EXPECT_EQ(state("abc"), "queued");
  store().lose(claim(), kCrash);
  EXPECT_EQ(state("abc"), "failed") << "three attempts in a row made no progress";
}

TEST_F(AttemptsTest, AttemptsLostWithTheirServerCountAQuarter) {
  const Loss restart{.what = "ended with its server", .with_server = true};
  submit("abc");
  for (int attempt = 1; attempt <= 11; ++attempt) EXPECT_TRUE(store().lose(claim(), restart));
  EXPECT_EQ(state("abc"), "queued");
  store().lose(claim(), restart);
  EXPECT_EQ(state("abc"), "failed") << "a job must not crash its server forever";
  EXPECT_THAT(job().error().detail(), HasSubstr("12 attempts in a row were lost"));
}

TEST_F(AttemptsTest, AttemptsOverALimitCountInSpiteOfProgress) {
  submit("abc");
  for (int attempt = 1; attempt <= 3; ++attempt) {
    const Claim held = claim();
    write_checkpoint(held);
    EXPECT_TRUE(store().lose(held, kOutOfTime));
  }
  EXPECT_EQ(job().state(), "failed");
  EXPECT_EQ(job().error().code(), "time_limit_exceeded");
  EXPECT_THAT(job().error().detail(), HasSubstr("attempt 3 needed more than 5 s of processor time"));
}

TEST_F(AttemptsTest, AnEndedWorkerLosesItsOwnClaimsOnly) {
  submit("a");
  submit("b");
  submit("c");
  const Claim a = claim("dead"), b = claim("alive");
  EXPECT_THAT(store().busy_workers(), testing::UnorderedElementsAre("alive", "dead"));
  store().lose_all("dead", kCrash);
  EXPECT_THAT(store().busy_workers(), ElementsAre("alive"));
  EXPECT_EQ(store().check(a), Hold::kLost);
  EXPECT_EQ(store().check(b), Hold::kHeld);
  EXPECT_EQ(state("a"), "queued");
  EXPECT_EQ(claim().job_id, "a") << "the job has kept its place";
  store().lose_all("dead", kCrash);
  EXPECT_EQ(state("a"), "running");
}

TEST_F(AttemptsTest, ALostJobWithACancelRequestIsCancelled) {
  submit("abc");
  const Claim held = claim();
  store().cancel("abc");
  EXPECT_TRUE(store().lose(held, kCrash));
  EXPECT_EQ(state("abc"), "cancelled");
}

TEST_F(AttemptsTest, AFailingJobDoesNotBlockOthers) {
  submit("bad");
  submit("cafe");
  for (int attempt = 1; attempt <= 3; ++attempt) store().lose(claim(), kCrash);
  EXPECT_EQ(claim().job_id, "cafe");
}

}  // namespace
}  // namespace creased::test
