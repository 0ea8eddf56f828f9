#include "server/worker/inspector.h"

#include "crease/v1/compute.pb.h"
#include "server/base/failure.h"
#include "server/jobs/needs.h"

namespace creased {
namespace code = crease::code;
namespace v1 = crease::v1;
namespace {

v1::ComputeLimits limits_of(const Inspector::Options& options) {
  v1::ComputeLimits limits;
  limits.set_memory_bytes(std::uint64_t{options.memory_limit_mb} << 20U);
  limits.set_cpu_seconds(static_cast<std::uint64_t>(std::chrono::ceil<std::chrono::seconds>(options.timeout).count()));
  limits.set_file_bytes(1);  // an inspection writes no files
  limits.set_max_vertices(options.max_vertices);
  limits.set_max_faces(options.max_faces);
  return limits;
}

}  // namespace

Inspection Inspector::inspect(const Upload& upload) {
  v1::ComputeTask task;
  *task.mutable_limits() = limits_of(options_);
  task.mutable_inspect()->set_format(upload.format);
  task.mutable_inspect()->set_name(upload.name);
  task.set_has_weights(!upload.weights.empty());
  const Descriptor file = open_to_read(upload.mesh),
                   weights = upload.weights.empty() ? Descriptor() : open_to_read(upload.weights);
  std::vector<int> files{file.get()};
  if (weights.open()) files.push_back(weights.get());
  const auto work = reading_time(std::filesystem::file_size(upload.mesh));
  const auto outcome = pool_.run({.owner = upload.owner}, task, files, work, options_.timeout);
  const auto& event =
      TaskPool::event_of(outcome, v1::ComputeEvent::kInspected, code::kInspectionFailed, "checking the mesh");
  const v1::Inspection& found = event.inspected();
  return {found.facts(), {found.warnings().begin(), found.warnings().end()}};
}

}  // namespace creased
