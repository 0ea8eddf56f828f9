#include "core/job.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace crease {
namespace {

double signed_volume(const std::vector<Vec3>& positions, const std::vector<Triangle>& triangles) {
  if (positions.empty()) return 0;
  const Vec3& origin = positions.front();
  double sum = 0;
  for (const auto& [a, b, c] : triangles) {
    sum += (positions[a] - origin).dot((positions[b] - origin).cross(positions[c] - origin));
  }
  return sum / 6;
}

double volume_change(const Mesh& before, const Mesh& after) {
  const double volume = signed_volume(before.positions, before.triangles);
  const double change = signed_volume(after.positions, after.triangles) - volume;
  return volume != 0 ? change / std::abs(volume) : 0;
}

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
  // Without a closed surface there is no volume to change.
  if (input.facts.boundary_edges == 0 && input.facts.nonmanifold_edges == 0) {
    facts.volume_change = volume_change(input.mesh, result.mesh);
  }
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
