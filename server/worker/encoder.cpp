#include "server/worker/encoder.h"

#include <array>

#include "server/base/failure.h"
#include "server/jobs/needs.h"

namespace creased {
namespace v1 = crease::v1;
namespace {

v1::ComputeTask task_of(const Encoder::Options& options, const v1::EncodeTask& encoding) {
  v1::ComputeTask task;
  *task.mutable_encode() = encoding;
  v1::ComputeLimits& limits = *task.mutable_limits();
  limits.set_memory_bytes(std::uint64_t{options.memory_limit_mb} << 20U);
  limits.set_cpu_seconds(static_cast<std::uint64_t>(std::chrono::ceil<std::chrono::seconds>(options.timeout).count()));
  limits.set_file_bytes(needs_of(encoding.job().input(), encoding.job().parameters().sweeps()).encoded_bytes);
  return task;
}

}  // namespace

bool Encoder::encode(const TaskPool::Asker& asker, const v1::EncodeTask& task, int source, std::uint64_t source_bytes,
                     int target) {
  const std::array files{source, target};
  const auto outcome = pool_.run(asker, task_of(options_, task), files, reading_time(source_bytes), options_.timeout);
  if (outcome.left) return false;
  TaskPool::event_of(outcome, v1::ComputeEvent::kEncoded, code::kEncodingFailed, "making the file");
  return true;
}

}  // namespace creased
