#include "core/job.h"

#include <algorithm>
#include <cmath>

#include "core/measure/measure.h"

namespace crease {
namespace {

ResultFacts result_facts(const CheckedInput& input, const LabelledMesh& result, double seconds) {
  ResultFacts facts;
  facts.seconds = seconds;
  for (std::size_t e = 0; e < result.edges.size(); ++e) {
    if (result.labels[e] < kRidgeThreshold) continue;
    const auto [v0, v1] = result.edges[e];
    ++facts.ridge_edges;
    facts.ridge_length += (result.mesh.positions[v0] - result.mesh.positions[v1]).norm();
  }
  double squares = 0;
  for (std::size_t v = 0; v < input.mesh.positions.size(); ++v) {
    const double moved = (result.mesh.positions[v] - input.mesh.positions[v]).norm() / input.facts.mean_edge_length;
    facts.max_displacement = std::max(facts.max_displacement, moved);
    squares += moved * moved;
  }
  facts.rms_displacement = std::sqrt(squares / static_cast<double>(input.mesh.positions.size()));
  facts.volume_change = relative_volume_change(input.mesh, input.topology, result.mesh.positions);
  return facts;
}

}  // namespace

CheckedInput check_input(std::string_view bytes, std::optional<MeshFormat> format, const DecodeLimits& limits) {
  DecodedMesh decoded = decode_mesh(bytes, format, limits);
  CheckedInput input;
  input.mesh = std::move(decoded.mesh);
  input.format = decoded.format;
  input.warnings = std::move(decoded.warnings);
  input.topology = build_topology(input.mesh);
  input.facts = inspect(input.mesh, input.topology, input.warnings);
  return input;
}

JobOutput run_job(const CheckedInput& input, const SmoothOptions& options, RunContext& context) {
  SmoothResult smoothed = smooth(input.mesh, input.topology, options, context);
  JobOutput output;
  output.result.mesh.positions = std::move(smoothed.positions);
  output.result.mesh.triangles = input.mesh.triangles;
  output.result.edges = input.topology.edges;
  output.result.labels = std::move(smoothed.labels);
  output.result.dihedral_rad = signed_dihedral_angles(output.result.mesh, input.topology, output.result.mesh.positions);
  output.facts = result_facts(input, output.result, smoothed.seconds);
  output.sweeps = std::move(smoothed.sweeps);
  output.cancelled = smoothed.cancelled;
  return output;
}

}  // namespace crease
