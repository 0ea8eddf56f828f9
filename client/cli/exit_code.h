#pragma once

#include <string>
#include <string_view>

namespace crease::client {

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

/// Error codes that only the client has. All others are rows of the table of errors.
namespace code {
inline constexpr std::string_view kUsage = "usage";
inline constexpr std::string_view kFileUnreadable = "file_unreadable";
inline constexpr std::string_view kFileUnwritable = "file_unwritable";
inline constexpr std::string_view kServerUnreachable = "server_unreachable";
inline constexpr std::string_view kInterrupted = "interrupted";
}  // namespace code

/// The exit code for an error. For codes that this client does not know, the HTTP status decides; 0 means that there is
/// none.
ExitCode exit_code_of(std::string_view error_code, int status = 0);

/// All exit codes with their meanings, for `crease --help`.
std::string exit_code_help();

}  // namespace crease::client
