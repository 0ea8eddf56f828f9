#include "core/smooth/classical/classical.h"

#include "core/base/stopwatch.h"
#include "core/solve/vertex_fit.h"

namespace crease {

PinnedSurface::PinnedSurface(const Mesh& mesh, const Topology& mesh_topology)
    : Surface(mesh, mesh_topology), is_movable(inner_vertices(mesh_topology)) {
  for (Index v = 0; v < is_movable.size(); ++v) {
    if (is_movable[v] != 0) movable.push_back(v);
  }
}

void fit_to_normals(PinnedSurface& surface, const std::vector<Vec3>& normals, std::uint32_t steps) {
  ThreadTeam alone(1);
  fit_vertices(
      surface, steps, [&](Index f) -> const Vec3& { return normals[f]; },
      [&](std::size_t v) { return surface.is_movable[v] != 0; }, alone);
}

SmoothResult iterate(const Mesh& measured, const Topology& topology, std::uint32_t iterations,
                     const std::function<ClassicalStep(PinnedSurface&)>& make_step, RunContext& context) {
  const Stopwatch stopwatch;
  PinnedSurface surface(measured, topology);
  const ClassicalStep step = make_step(surface);
  SmoothResult result;
  result.labels.assign(topology.edges.size(), 0);
  const auto positions = [&] { return surface.upload_positions(measured); };
  const auto labels = [&] { return result.labels; };
  bool may_gain = true;
  while (may_gain && !result.cancelled && result.sweeps.size() < iterations) {
    may_gain = step();
    SweepRecord& record = result.sweeps.emplace_back();
    record.sweep = static_cast<std::uint32_t>(result.sweeps.size());
    record.stage = kClassicalStage;
    const bool goes_on =
        !context.on_sweep || context.on_sweep({record, iterations, stopwatch.seconds(), labels, positions});
    result.cancelled = !goes_on || context.cancel.load();
  }
  result.positions = positions();
  result.seconds = stopwatch.seconds();
  return result;
}

}  // namespace crease
