#pragma once

namespace crease {

/// Exit codes of `crease`. Scripts rely on the numbers.
enum class ExitCode {
  kOk = 0,
  kInternal = 1,
  kUsage = 2,
  kInputRefused = 3,
  kServerUnreachable = 4,
  kJobFailed = 5,
  kCancelled = 6,
  kNotFound = 7,
  kNotFinished = 8,
  kFile = 9,
  kKeyRefused = 10,
  kOverLimit = 11,
};

}  // namespace crease
