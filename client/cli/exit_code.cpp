#include "client/cli/exit_code.h"

#include <fmt/format.h>

#include <array>

#include "proto/error_table.h"

namespace crease::client {
namespace {

struct Meaning {
  ExitCode code;
  std::string_view text;
};

constexpr auto kMeanings = std::to_array<Meaning>({
    {ExitCode::kOk, "done"},
    {ExitCode::kInternal, "internal error of the client or the server"},
    {ExitCode::kUsage, "wrong usage or an invalid parameter"},
    {ExitCode::kInputRefused, "the mesh or its weights are not valid"},
    {ExitCode::kServerUnreachable, "the server cannot be reached or accepts no requests"},
    {ExitCode::kJobFailed, "the job failed"},
    {ExitCode::kCancelled, "the job was cancelled or the command was interrupted"},
    {ExitCode::kNotFound, "the job does not exist"},
    {ExitCode::kNotFinished, "the job has not finished"},
    {ExitCode::kFile, "a file cannot be read or written"},
    {ExitCode::kKeyRefused, "the key is missing, not valid, or may not do this"},
    {ExitCode::kOverLimit, "a limit of the service is reached; try again later"},
});

ExitCode by_status(int status) {
  if (status == 401 || status == 403) return ExitCode::kKeyRefused;
  if (status == 429 || status == 507) return ExitCode::kOverLimit;
  if (status == 503) return ExitCode::kServerUnreachable;
  if (status == 404) return ExitCode::kNotFound;
  if (status == 409) return ExitCode::kNotFinished;
  if (status == 422) return ExitCode::kInputRefused;
  return status >= 400 && status < 500 ? ExitCode::kUsage : ExitCode::kInternal;
}

}  // namespace

ExitCode exit_code_of(std::string_view name, int status) {
  const ErrorKind* const kind = find_error_kind(name);
  return kind == nullptr ? by_status(status) : kind->exit_code;
}

std::string exit_code_help() {
  std::string help = "Exit codes:\n";
  for (const auto& [exit_code, text] : kMeanings)
    help += fmt::format("  {:<2}  {}\n", static_cast<int>(exit_code), text);
  return help;
}

}  // namespace crease::client
