#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/event_parser.h"
#include "client/cli/exit_code.h"
#include "client/cli/progress_bar.h"
#include "core/error.h"
#include "proto/error_table.h"

namespace crease::client {
namespace {

using testing::HasSubstr;

const std::string kStream =
    "retry: 1000\n\n: still here\n\nid: 7\nevent: progress\ndata: {\"a\": 1}\n\n"
    "id: 8\r\nevent: succeeded\r\ndata: one\r\ndata:two\r\n\r\ndata: last\n\n";

TEST(EventParser, FindsTheSameEventsWhereverTheStreamIsCut) {
  for (std::size_t size = 1; size <= kStream.size(); ++size) {
    EventParser parser;
    std::vector<Event> events;
    for (std::size_t i = 0; i < kStream.size(); i += size) {
      for (const Event& event : parser.feed(kStream.substr(i, size))) events.push_back(event);
    }
    ASSERT_EQ(events.size(), 3U) << size;
    EXPECT_EQ(events[0].id, "7");
    EXPECT_EQ(events[0].type, "progress");
    EXPECT_EQ(events[0].data, "{\"a\": 1}");
    EXPECT_EQ(events[1].type, "succeeded");
    EXPECT_EQ(events[1].data, "one\ntwo");
    EXPECT_EQ(events[2].id, "8");
    EXPECT_EQ(events[2].type, "message");
  }
}

TEST(ExitCode, EveryErrorHasTheExitCodeOfItsKind) {
  for (const ErrorKind& kind : error_table()) {
    const ExitCode exit_code = kind.exit_code;
    EXPECT_EQ(exit_code, exit_code_of(kind.name)) << kind.name;
    EXPECT_NE(exit_code, ExitCode::kOk) << kind.name;
    if (kind.name.starts_with("mesh_")) {
      EXPECT_EQ(exit_code, ExitCode::kInputRefused) << kind.name;
    } else if (kind.name.starts_with("parameter_")) {
      EXPECT_EQ(exit_code, ExitCode::kUsage) << kind.name;
    } else if (kind.status == 503) {
      EXPECT_EQ(exit_code, ExitCode::kServerUnreachable) << kind.name;
    }
  }
  EXPECT_EQ(exit_code_of("job_not_found", 404), ExitCode::kNotFound);
  EXPECT_EQ(exit_code_of("job_failed", 409), ExitCode::kJobFailed);
  EXPECT_EQ(exit_code_of("job_cancelled", 409), ExitCode::kCancelled);
  EXPECT_EQ(exit_code_of("job_not_finished", 409), ExitCode::kNotFinished);
  EXPECT_EQ(exit_code_of("internal", 500), ExitCode::kInternal);
}

TEST(ExitCode, TheStatusDecidesForCodesOfANewerServer) {
  EXPECT_EQ(exit_code_of("mesh_haunted", 422), ExitCode::kInputRefused);
  EXPECT_EQ(exit_code_of("key_tired", 403), ExitCode::kKeyRefused);
  EXPECT_EQ(exit_code_of("queue_odd", 503), ExitCode::kServerUnreachable);
  EXPECT_EQ(exit_code_of("call_odd", 400), ExitCode::kUsage);
  EXPECT_EQ(exit_code_of("odd", 0), ExitCode::kInternal);
}

TEST(ExitCode, HelpListsAll) {
  for (int i = 0; i <= static_cast<int>(ExitCode::kFile); ++i) {
    EXPECT_THAT(exit_code_help(), HasSubstr("\n  " + std::to_string(i) + "  "));
  }
}

TEST(ProgressText, ShowsOnlyWhatIsKnown) {
  v1::Progress progress;
  progress.set_stage("queued");
  EXPECT_EQ(progress_text(progress), "queued   0 %");
  progress.set_stage("smoothing");
  progress.set_fraction(0.4);
  progress.set_sweep(120);
  progress.set_sweeps(300);
  progress.mutable_energy()->set_total(1234.5);
  progress.set_eta_seconds(150);
  EXPECT_EQ(progress_text(progress), "smoothing  40 %  sweep 120/300  energy 1234.5  ETA 2:30 min");
}

}  // namespace
}  // namespace crease::client
