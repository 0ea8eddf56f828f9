#include "server/base/failure.h"

#include <fmt/format.h>

#include <cerrno>
#include <system_error>

namespace creased {
namespace code = crease::code;

std::string errno_text(int number) { return std::generic_category().message(number); }

bool is_fault_of_store(crease::ErrorCode code) {
  return code == code::kStoreUnavailable || code == code::kStorageFull || code == code::kProcessUnavailable;
}

bool is_limit_of_job(crease::ErrorCode code) {
  return code == code::kMemoryExhausted || code == code::kFileLimitExceeded;
}

crease::Error file_failure(std::string_view action, const std::filesystem::path& path) {
  const int number = errno;
  const bool full = number == ENOSPC || number == EDQUOT;
  return {full ? code::kStorageFull : code::kStoreUnavailable,
          fmt::format("cannot {} {}: {}", action, path.string(), errno_text(number))};
}

}  // namespace creased
