#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <unordered_map>

#include "server/base/durable_file.h"
#include "server/store/store.h"

namespace creased {

/// The complete files of jobs, compared by size and SHA-256 with what the store has recorded of them. Nothing that
/// differs is served.
class CheckedFiles {
 public:
  explicit CheckedFiles(Store& store) : store_(store) {}

  /// Opens a file that was made from a result. Returns null when there is none as recorded. The content is compared
  /// when the file has changed since the last time. \throw crease::Error store_unavailable
  std::shared_ptr<const OpenFile> open(std::string_view id, std::string_view name);
  /// Opens a file that a job has left. A job of a version that kept no records has none to compare with.
  /// \throw crease::Error result_damaged when it is missing or differs; store_unavailable
  std::shared_ptr<const OpenFile> require(std::string_view id, std::string_view name);

 private:
  using Stamp = std::array<std::int64_t, 7>;
  enum class State { kSound, kDamaged, kUnknown };

  static Stamp stamp_of(int file);
  State state_of(const OpenFile& file, std::string_view id, std::string_view name);

  Store& store_;
  std::mutex mutex_;
  std::unordered_map<std::string, Stamp> sound_;  // by job and name: the state in which the content was compared
};

}  // namespace creased
