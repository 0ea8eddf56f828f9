#pragma once

#include <string>

#include "crease/v1/job.pb.h"

namespace crease::client {

/// Shows the progress of a job on standard error. On a terminal it redraws one line; elsewhere it prints a line for
/// every new stage and about every 10 %.
class ProgressBar {
 public:
  enum class Style { kNone, kTerminal, kLines };
  explicit ProgressBar(Style style) : style_(style) {}
  ~ProgressBar() { finish(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// kNone for a quiet command; otherwise it depends on whether standard error is a terminal.
  static Style style(bool quiet);

  void update(const v1::Progress& progress);
  /// Ends the line, so that further output starts on a new one.
  void finish();

 private:
  Style style_;
  bool drawn_ = false;
  std::string last_stage_;
  int last_tenth_ = -1;
};

/// For example "smoothing  40 %  sweep 120/300  energy 1234  ETA 12 s". Leaves out what is not known yet.
std::string progress_text(const v1::Progress& progress);

}  // namespace crease::client
