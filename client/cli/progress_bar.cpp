#include "client/cli/progress_bar.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace crease::client {
namespace {

constexpr int kBarWidth = 24;

std::string duration_text(double seconds) {
  const long whole = std::lround(seconds);
  return whole < 120 ? fmt::format("{} s", whole) : fmt::format("{}:{:02} min", whole / 60, whole % 60);
}

}  // namespace

ProgressBar::Style ProgressBar::style(bool quiet) {
  if (quiet) return Style::kNone;
  return ::isatty(STDERR_FILENO) != 0 ? Style::kTerminal : Style::kLines;
}

void ProgressBar::update(const v1::Progress& progress) {
  if (style_ == Style::kNone) return;
  if (style_ == Style::kTerminal) {
    const int full = static_cast<int>(std::clamp(progress.fraction(), 0.0, 1.0) * kBarWidth);
    fmt::print(stderr, "\r[{:<{}}] {}\033[K", std::string(static_cast<std::size_t>(full), '#'), kBarWidth,
               progress_text(progress));
    std::fflush(stderr);
    drawn_ = true;
    return;
  }
  const int tenth = static_cast<int>(progress.fraction() * 10);
  if (progress.stage() == last_stage_ && tenth == last_tenth_) return;
  last_stage_ = progress.stage();
  last_tenth_ = tenth;
  fmt::print(stderr, "{}\n", progress_text(progress));
}

void ProgressBar::finish() {
  if (drawn_) fmt::print(stderr, "\n");
  drawn_ = false;
}

std::string progress_text(const v1::Progress& progress) {
  std::string text = fmt::format("{} {:3.0f} %", progress.stage(), 100 * progress.fraction());
  if (progress.sweep() > 0) {
    text += fmt::format("  sweep {}/{}  energy {:.5g}", progress.sweep(), progress.sweeps(), progress.energy().total());
    text += fmt::format("  ETA {}", duration_text(progress.eta_seconds()));
  }
  return text;
}

}  // namespace crease::client
