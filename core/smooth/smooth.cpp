#include "core/smooth/smooth.h"

#include <algorithm>
#include <chrono>
#include <memory>

#include "core/smooth/annealing.h"
#include "core/smooth/renumbering.h"

namespace crease {
namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

template <typename Value>
std::vector<Value> gathered(const std::vector<Value>& values, const std::vector<Index>& places) {
  std::vector<Value> result;
  result.reserve(places.size());
  for (const Index place : places) result.push_back(values[place]);
  return result;
}

std::vector<std::unique_ptr<Stage>> make_stages(Annealing& annealing) {
  std::vector<std::unique_ptr<Stage>> stages;
  const auto [process, sweeps] = std::pair(annealing.options.process, annealing.options.sweeps);
  const std::uint32_t face_sweeps = process == Process::kFace ? sweeps : process == Process::kBoth ? sweeps / 2 : 0;
  if (face_sweeps > 0) stages.push_back(make_face_stage(annealing, face_sweeps));
  if (face_sweeps < sweeps) stages.push_back(make_vertex_stage(annealing, sweeps - face_sweeps));
  return stages;
}

}  // namespace

SmoothResult smooth(const Mesh& measured, const Topology& topology, const SmoothOptions& options, RunContext& context,
                    std::span<const double> weights) {
  const auto start = std::chrono::steady_clock::now();
  const Renumbering renumbering(measured);
  Topology renumbered = build_topology(renumbering.mesh);
  const std::vector<Index> edges = new_edges(renumbering, topology, renumbered);
  adopt_orientation(topology, renumbering.new_face, edges, renumbered);
  const std::vector<double> new_weights = renumbering.renumbered(weights);
  Annealing annealing(renumbering.mesh, renumbered, options, new_weights);
  const std::vector<std::unique_ptr<Stage>> stages = make_stages(annealing);
  const auto positions = [&] {
    return gathered(annealing.field.upload_positions(renumbering.mesh), renumbering.new_vertex);
  };
  const auto labels = [&] { return gathered(annealing.field.labels, edges); };

  SmoothResult result;
  for (const auto& stage : stages) {
    annealing.restart_average();
    for (std::uint32_t index = 0; index < stage->sweeps() && !result.cancelled; ++index) {
      SweepRecord& record = result.sweeps.emplace_back();
      record.sweep = static_cast<std::uint32_t>(result.sweeps.size());
      stage->sweep(index, record.sweep, record);
      result.site_proposals += stage->sites();
      result.label_proposals += annealing.edge_sites();
      if (context.on_sweep) {
        result.cancelled = !context.on_sweep({record, options.sweeps, seconds_since(start), labels, positions});
      }
      result.cancelled = result.cancelled || context.cancel.load();
    }
  }
  result.positions = positions();
  result.labels = gathered(annealing.expected_labels(), edges);
  result.seconds = seconds_since(start);
  return result;
}

}  // namespace crease
