#include "server/worker/encoder.h"

#include <algorithm>
#include <vector>

#include "proto/result_formats.h"
#include "server/base/failure.h"
#include "server/jobs/needs.h"

namespace creased {
namespace code = crease::code;
namespace v1 = crease::v1;
namespace {

/// What an upload adds to a file at most, whose texture coordinates may become text and whose images base64, and to the
/// memory in which that is made.
constexpr std::uint64_t kFilePerByteOfUpload = 4, kMemoryPerByteOfUpload = 6;

v1::ComputeTask task_of(const Encoder::Options& options, const v1::EncodeTask& encoding) {
  v1::ComputeTask task;
  *task.mutable_encode() = encoding;
  v1::ComputeLimits& limits = *task.mutable_limits();
  limits.set_cpu_seconds(static_cast<std::uint64_t>(std::chrono::ceil<std::chrono::seconds>(options.timeout).count()));
  const v1::InputFacts& input = encoding.job().input();
  const Needs needs = needs_of(input, encoding.job().parameters());
  const std::uint64_t of_upload = encoding.has_upload() ? input.bytes() : 0;
  limits.set_memory_bytes(
      std::min(needs.memory_bytes + kMemoryPerByteOfUpload * of_upload, std::uint64_t{options.memory_limit_mb} << 20U));
  limits.set_file_bytes(needs.encoded_bytes + kFilePerByteOfUpload * of_upload);
  return task;
}

}  // namespace

bool Encoder::encode(const TaskPool::Asker& asker, const v1::EncodeTask& task, int source, std::uint64_t source_bytes,
                     int target, int upload) {
  std::vector<int> files{source, target};
  if (upload >= 0) files.push_back(upload);
  const auto outcome = pool_.run(asker, task_of(options_, task), files, reading_time(source_bytes), options_.timeout);
  if (outcome.left) return false;
  TaskPool::event_of(outcome, v1::ComputeEvent::kEncoded, code::kEncodingFailed, "making the file");
  return true;
}

}  // namespace creased
