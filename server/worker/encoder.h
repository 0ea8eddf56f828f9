#pragma once

#include <chrono>
#include <cstdint>

#include "crease/v1/compute.pb.h"
#include "server/worker/task_pool.h"

namespace creased {

/// Makes the files that results are handed out in, in confined processes: the HTTP process parses no result.
class Encoder {
 public:
  struct Options {
    std::size_t memory_limit_mb = 4096;  ///< address space of one encoding
    std::chrono::milliseconds timeout{120'000};
  };
  Encoder(TaskPool& pool, const Options& options) : pool_(pool), options_(options) {}

  /// Encodes an open stored file of `source_bytes` bytes into the open file `target`; `upload` is open if the
  /// task has it, otherwise −1. Waits for its turn first. Returns false when the asker has left.
  /// \throw crease::Error result_damaged, not_found, storage_full, process_unavailable, or encoding_failed when the
  /// process crashed or exceeded a limit
  bool encode(const TaskPool::Asker& asker, const crease::v1::EncodeTask& task, int source, std::uint64_t source_bytes,
              int target, int upload = -1);

 private:
  TaskPool& pool_;
  const Options options_;
};

}  // namespace creased
