#pragma once

#include <string>

#include "crease/v1/job.pb.h"

namespace crease::client {

/// The progress of a job on standard error: one line that is drawn over and over on a terminal, otherwise a line at
/// every new stage and about every tenth of the way.
class ProgressBar {
 public:
  enum class Style { kNone, kTerminal, kLines };
  explicit ProgressBar(Style style) : style_(style) {}
  ~ProgressBar() { finish(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// kNone for a quiet command, else by what standard error is.
  static Style style(bool quiet);

  void update(const v1::Progress& progress);
  /// Leaves the line, so that what follows starts on a fresh one.
  void finish();

 private:
  Style style_;
  bool drawn_ = false;
  std::string last_stage_;
  int last_tenth_ = -1;
};

/// "smoothing  40 %  sweep 120/300  energy 1234  ETA 12 s", without what is not known yet.
std::string progress_text(const v1::Progress& progress);

}  // namespace crease::client
