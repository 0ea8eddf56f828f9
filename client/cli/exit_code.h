#pragma once

#include <string>
#include <string_view>

namespace crease::client {

/// How `crease` ends. Scripts rely on the numbers.
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

/// Codes of what only the client refuses; all others are rows of the service's table.
namespace code {
inline constexpr std::string_view kUsage = "usage";
inline constexpr std::string_view kFileUnreadable = "file_unreadable";
inline constexpr std::string_view kFileUnwritable = "file_unwritable";
inline constexpr std::string_view kServerUnreachable = "server_unreachable";
inline constexpr std::string_view kInterrupted = "interrupted";
}  // namespace code

/// The exit code for an error; `status` is that of HTTP, or 0, and decides for codes that this client does not know.
ExitCode exit_code_of(std::string_view error_code, int status = 0);

/// Every exit code with its meaning, for `crease --help`.
std::string exit_code_help();

}  // namespace crease::client
