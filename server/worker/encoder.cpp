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

v1::ComputeTask task_of(const Encoder::Options& options, const v1::EncodeTask& encoding) {
  v1::ComputeTask task;
  *task.mutable_encode() = encoding;
  v1::ComputeLimits& limits = *task.mutable_limits();
  limits.set_cpu_seconds(static_cast<std::uint64_t>(std::chrono::ceil<std::chrono::seconds>(options.timeout).count()));
  const v1::InputFacts& input = encoding.job().input();
  const Needs needs = needs_of(input, encoding.job().parameters());
  limits.set_memory_bytes(std::min(needs.memory_bytes, std::uint64_t{options.memory_limit_mb} << 20U));
  limits.set_file_bytes(needs.encoded_bytes +
                        (encoding.format() == crease::kOriginal ? 2 * std::uint64_t{input.bytes()} : 0));
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
