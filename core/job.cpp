#include "core/job.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/features/features.h"
#include "core/io/vertex_weights.h"
#include "core/measure/measure.h"

namespace crease {
namespace {

ResultFacts result_facts(const CheckedInput& input, const LabelledMesh& result, const Features& features,
                         double seconds) {
  ResultFacts facts;
  facts.seconds = seconds;
  facts.ridge_lines = static_cast<std::uint32_t>(features.ridge_lines.size());
  facts.corners = static_cast<std::uint32_t>(features.corners.size());
  facts.segments = features.segment_count;
  for (std::size_t e = 0; e < result.edges.size(); ++e) {
    if (!is_ridge(result.labels[e])) continue;
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

/// `sigma` in the upload's units, not empty.
UncertaintyFacts uncertainty_facts(std::vector<double> sigma, double mean_edge_length) {
  if (mean_edge_length > 0) {
    for (double& value : sigma) value /= mean_edge_length;
  }
  const auto middle = sigma.begin() + static_cast<std::ptrdiff_t>(sigma.size() / 2);
  std::ranges::nth_element(sigma, middle);
  const double median = *middle;
  const double sum = std::accumulate(sigma.begin(), sigma.end(), 0.0);
  return {sum / static_cast<double>(sigma.size()), median, *std::ranges::max_element(sigma)};
}

void settle_weights(std::vector<double> of_mesh, std::optional<std::string_view> beside, CheckedInput& input) {
  const bool replaced = beside && !of_mesh.empty();
  input.weights = beside ? read_weights(*beside, input.mesh.positions.size()) : std::move(of_mesh);
  if (replaced) {
    input.warnings.push_back({"weights_replaced", "the mesh file has weights too; those that came beside it are used"});
  }
  if (!input.weights.empty() && std::ranges::all_of(input.weights, [](double weight) { return weight == 0; })) {
    input.warnings.push_back({"weights_all_zero", "every weight is 0: the measured positions hold no vertex"});
  }
}

}  // namespace

CheckedInput check_input(std::string_view bytes, std::optional<MeshFormat> format, const DecodeLimits& limits,
                         std::optional<std::string_view> weights) {
  DecodedMesh decoded = decode_mesh(bytes, format, limits);
  CheckedInput input;
  input.mesh = std::move(decoded.mesh);
  input.format = decoded.format;
  input.warnings = std::move(decoded.warnings);
  input.topology = build_topology(input.mesh);
  input.facts = inspect(input.mesh, input.topology, input.warnings);
  settle_weights(std::move(decoded.weights), weights, input);
  return input;
}

JobOutput run_job(const CheckedInput& input, const SmoothOptions& options, RunContext& context) {
  SmoothResult smoothed = smooth(input.mesh, input.topology, options, context, input.weights);
  JobOutput output;
  LabelledMesh& result = output.result;
  result.mesh.positions = std::move(smoothed.positions);
  result.mesh.triangles = input.mesh.triangles;
  result.edges = input.topology.edges;
  result.labels = std::move(smoothed.labels);
  result.dihedral_rad = signed_dihedral_angles(result.mesh, input.topology, result.mesh.positions);
  Features features = find_features(result.mesh, input.topology, result.mesh.positions, result.labels);
  output.facts = result_facts(input, result, features, smoothed.seconds);
  output.facts.choice = std::move(smoothed.choice);
  if (!smoothed.sigma.empty()) {
    output.facts.uncertainty = uncertainty_facts(smoothed.sigma, input.facts.mean_edge_length);
  }
  result.sigma = std::move(smoothed.sigma);
  result.classes = std::move(features.classes);
  result.segments = std::move(features.segments);
  result.ridge_lines = std::move(features.ridge_lines);
  result.corners = std::move(features.corners);
  output.sweeps = std::move(smoothed.sweeps);
  output.cancelled = smoothed.cancelled;
  return output;
}

}  // namespace crease
