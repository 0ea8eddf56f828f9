#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/error.h"

namespace creased {

/// The message of the operating system for an errno.
std::string errno_text(int number);

/// Whether an error with this code is the store's own fault, which no job has caused.
bool is_fault_of_store(crease::ErrorCode code);

/// Whether an error with this code says that a process has reached a limit that its job has set.
bool is_limit_of_job(crease::ErrorCode code);

/// Error storage_full when errno says so, otherwise store_unavailable, with the detail
/// "cannot `action` PATH: message of errno". Call it before errno changes.
crease::Error file_failure(std::string_view action, const std::filesystem::path& path);

}  // namespace creased
