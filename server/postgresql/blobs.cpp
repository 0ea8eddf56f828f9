#include "server/postgresql/blobs.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "server/base/failure.h"

namespace creased {
namespace code = crease::code;
namespace {

constexpr std::size_t kChunkBytes = 1U << 20U;
constexpr std::size_t kMostCachedFiles = 64;

}  // namespace

BlobRef write_blob(Transaction& transaction, int file, const std::filesystem::path& path) {
  BlobRef blob;
  blob.id = transaction.run("SELECT nextval('blob_ids')")[0][0].as<std::int64_t>();
  std::string piece(kChunkBytes, '\0');
  for (std::int64_t number = 0;; ++number) {
    std::size_t have = 0;
    while (have < piece.size()) {
      const ssize_t count =
          ::pread(file, piece.data() + have, piece.size() - have, static_cast<off_t>(blob.bytes + have));
      if (count < 0 && errno == EINTR) continue;
      if (count < 0) throw file_failure("read", path);
      if (count == 0) break;
      have += static_cast<std::size_t>(count);
    }
    if (have == 0) return blob;
    transaction.run("INSERT INTO chunks VALUES ($1, $2, $3)", blob.id, number,
                    Bytes{std::string_view(piece).substr(0, have)});
    blob.bytes += have;
  }
}

void read_blob(Transaction& transaction, const BlobRef& blob, int target, const std::filesystem::path& path) {
  std::uint64_t have = 0;
  for (std::int64_t number = 0; have < blob.bytes; ++number) {
    const auto rows = transaction.run("SELECT bytes FROM chunks WHERE blob = $1 AND number = $2", blob.id, number);
    if (rows.empty()) {
      throw crease::Error(code::kStoreUnavailable,
                          fmt::format("the database has only {} of {} bytes of a file", have, blob.bytes));
    }
    const pqxx::binarystring piece(rows[0][0]);
    if (!write_all(target, {piece.get(), piece.size()})) throw file_failure("write", path);
    have += piece.size();
  }
}

std::shared_ptr<const OpenFile> BlobCache::find(std::int64_t blob) {
  const std::lock_guard lock(mutex_);
  const auto found = std::ranges::find(files_, blob, [](const auto& entry) { return entry.first; });
  if (found == files_.end()) return nullptr;
  std::rotate(found, found + 1, files_.end());
  return files_.back().second;
}

void BlobCache::add(std::int64_t blob, std::shared_ptr<const OpenFile> file) {
  const std::lock_guard lock(mutex_);
  const bool known = std::ranges::find(files_, blob, [](const auto& entry) { return entry.first; }) != files_.end();
  if (known || file->bytes > most_bytes_) return;
  bytes_ += file->bytes;
  files_.emplace_back(blob, std::move(file));
  while (bytes_ > most_bytes_ || files_.size() > kMostCachedFiles) {
    bytes_ -= files_.front().second->bytes;
    files_.pop_front();
  }
}

}  // namespace creased
