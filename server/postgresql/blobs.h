#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "server/base/durable_file.h"
#include "server/postgresql/session.h"

namespace creased {

/// The content of a file, as rows of a table: pieces of a megabyte, written and read one after the other.
struct BlobRef {
  std::int64_t id = 0;
  std::uint64_t bytes = 0;
};

/// Writes the content of an open file as a new blob. \throw Error store_unavailable when the file cannot be read
BlobRef write_blob(Transaction& transaction, int file, const std::filesystem::path& path);

/// Writes a blob to an open file, whose path is for messages. \throw Error store_unavailable, storage_full
void read_blob(Transaction& transaction, const BlobRef& blob, int target, const std::filesystem::path& path);

/// The blobs that were read last, as open files without a name. A blob never changes, so they are never out of date.
class BlobCache {
 public:
  explicit BlobCache(std::uint64_t most_bytes) : most_bytes_(most_bytes) {}

  /// Null when the blob is not here.
  std::shared_ptr<const OpenFile> find(std::int64_t blob);
  void add(std::int64_t blob, std::shared_ptr<const OpenFile> file);

 private:
  const std::uint64_t most_bytes_;
  std::mutex mutex_;
  std::uint64_t bytes_ = 0;
  std::deque<std::pair<std::int64_t, std::shared_ptr<const OpenFile>>> files_;  // the last used at the end
};

}  // namespace creased
