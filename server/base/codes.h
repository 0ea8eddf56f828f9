#pragma once

#include <string_view>

namespace creased {

/// Error codes of the store and the workers. They are rows of the table of errors, as core's codes are.
namespace code {
inline constexpr std::string_view kStoreUnavailable = "store_unavailable";
inline constexpr std::string_view kStorageFull = "storage_full";
inline constexpr std::string_view kQuotaExceeded = "quota_exceeded";
inline constexpr std::string_view kQueueFull = "queue_full";
inline constexpr std::string_view kKeyQueueFull = "key_queue_full";
inline constexpr std::string_view kIdempotencyConflict = "idempotency_conflict";
inline constexpr std::string_view kJobNotFound = "job_not_found";
inline constexpr std::string_view kWorkerLost = "worker_lost";
inline constexpr std::string_view kInspectionFailed = "inspection_failed";
inline constexpr std::string_view kEncodingFailed = "encoding_failed";
inline constexpr std::string_view kMemoryExhausted = "memory_exhausted";
inline constexpr std::string_view kTimeLimitExceeded = "time_limit_exceeded";
inline constexpr std::string_view kFileLimitExceeded = "file_limit_exceeded";
inline constexpr std::string_view kUploadDamaged = "upload_damaged";
inline constexpr std::string_view kResultDamaged = "result_damaged";
inline constexpr std::string_view kProcessUnavailable = "process_unavailable";
inline constexpr std::string_view kInternal = "internal";
}  // namespace code

}  // namespace creased
