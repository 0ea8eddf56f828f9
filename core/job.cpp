#include "core/job.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/base/quantile.h"
#include "core/base/thread_team.h"
#include "core/features/features.h"
#include "core/io/vertex_weights.h"
#include "core/job_surface.h"
#include "core/measure/measure.h"

namespace crease {
namespace {

/// Facts of the surface that was smoothed. Every edge counts once, also where the upload has it twice at a seam.
ResultFacts result_facts(const JobSurface& surface, double mean_edge_length, const SmoothResult& smoothed,
                         const Features& features) {
  ResultFacts facts;
  facts.seconds = smoothed.seconds;
  facts.ridge_lines = static_cast<std::uint32_t>(features.ridge_lines.size());
  facts.corners = static_cast<std::uint32_t>(features.corners.size());
  facts.segments = features.segment_count;
  for (std::size_t e = 0; e < smoothed.labels.size(); ++e) {
    if (!is_ridge(smoothed.labels[e])) continue;
    const auto [v0, v1] = surface.topology().edges[e];
    ++facts.ridge_edges;
    facts.ridge_length += (smoothed.positions[v0] - smoothed.positions[v1]).norm();
  }
  const std::vector<Vec3>& measured = surface.mesh().positions;
  double squares = 0;
  for (std::size_t v = 0; v < measured.size(); ++v) {
    const double moved = (smoothed.positions[v] - measured[v]).norm() / mean_edge_length;
    facts.max_displacement = std::max(facts.max_displacement, moved);
    squares += moved * moved;
  }
  facts.rms_displacement = std::sqrt(squares / static_cast<double>(measured.size()));
  facts.volume_change = relative_volume_change(surface.mesh(), surface.topology(), smoothed.positions);
  facts.choice = smoothed.choice;
  facts.other_choices = smoothed.other_choices;
  return facts;
}

/// Warns where single precision rounds off more than a little of the coordinates, as those of maps.
void warn_of_single_precision(const std::vector<Vec3>& positions, double mean_edge_length,
                              std::vector<Warning>& warnings) {
  constexpr double kLittle = 1e-3;  // of the mean edge length
  double loss = 0;
  for (const Vec3& position : positions) {
    loss = std::max(loss, (position - position.cast<float>().cast<double>()).norm());
  }
  if (!(loss > kLittle * mean_edge_length)) return;
  warnings.push_back(
      {"single_precision_rounds",
       fmt::format("STL, and originals with coordinates in single precision, round these positions by up "
                   "to {:.3g} mean edge lengths; the other formats do not",
                   loss / mean_edge_length)});
}

/// `sigma` in the upload's units, not empty.
UncertaintyFacts uncertainty_facts(std::vector<double> sigma, double mean_edge_length) {
  if (mean_edge_length > 0) {
    for (double& value : sigma) value /= mean_edge_length;
  }
  const double median = quantile(sigma, 0.5);
  const double sum = std::accumulate(sigma.begin(), sigma.end(), 0.0);
  return {sum / static_cast<double>(sigma.size()), median, *std::ranges::max_element(sigma)};
}

/// While it lives, the caller of a run sees sweeps of the surface as sweeps of the upload.
class ShownSweeps {
 public:
  ShownSweeps(RunContext& context, const JobSurface& surface)
      : context_(context), surface_(surface), on_sweep_(std::move(context.on_sweep)) {
    context_.on_sweep = nullptr;
    if (on_sweep_) context_.on_sweep = [this](const SweepView& view) { return show(view); };
  }
  ~ShownSweeps() { context_.on_sweep = std::move(on_sweep_); }
  ShownSweeps(const ShownSweeps&) = delete;
  ShownSweeps& operator=(const ShownSweeps&) = delete;

 private:
  bool show(const SweepView& view) const {
    SweepView shown{view.record, view.sweeps, view.seconds, {}, {}, view.checkpoint};
    shown.fraction = view.fraction;
    shown.labels = [&] { return surface_.upload_edges(view.labels()); };
    shown.positions = [&] { return surface_.upload_positions(view.positions()); };
    shown.dihedral_rad = [&] {
      return surface_.upload_edges(signed_dihedral_angles(surface_.mesh(), surface_.topology(), view.positions()));
    };
    return on_sweep_(shown);
  }

  RunContext& context_;
  const JobSurface& surface_;
  std::function<bool(const SweepView&)> on_sweep_;
};

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

CheckedInput check_mesh(Mesh mesh, std::vector<double> weights, std::uint32_t threads) {
  require_faces_and_numbers(mesh);
  CheckedInput input;
  input.mesh = std::move(mesh);
  input.weights = std::move(weights);
  WeldFacts found;
  ThreadTeam team(threads, input.mesh.triangles.size());
  run_together(
      team, [&] { input.welded = weld(input.mesh, 0, found); }, [&] { input.topology = build_topology(input.mesh); });
  input.facts =
      inspect(input.mesh, input.topology, input.welded ? &*input.welded : nullptr, found, input.warnings, team);
  return input;
}

CheckedInput check_input(std::string_view bytes, std::optional<MeshFormat> format, const DecodeLimits& limits,
                         std::optional<std::string_view> weights, std::uint32_t threads) {
  DecodedMesh decoded = decode_mesh(bytes, format, limits);
  CheckedInput input = check_mesh(std::move(decoded.mesh), {}, threads);
  input.format = decoded.format;
  input.attributes = attributes_of(decoded.appearance, input.mesh.triangles);
  input.warnings.insert(input.warnings.begin(), decoded.warnings.begin(), decoded.warnings.end());
  settle_weights(std::move(decoded.weights), weights, input);
  return input;
}

JobOutput run_job(const CheckedInput& input, const SmoothOptions& options, RunContext& context) {
  const JobSurface surface(input, options.weld_tolerance);
  const auto smooth_surface = [&] {
    const ShownSweeps shown(context, surface);
    return smooth(surface.mesh(), surface.topology(), options, context, surface.weights());
  };
  SmoothResult smoothed = smooth_surface();
  const Mesh& mesh = surface.mesh();
  ThreadTeam team(options.threads, mesh.triangles.size());
  Features features = find_features(mesh, surface.topology(), smoothed.positions, smoothed.labels, {}, team);

  JobOutput output;
  output.facts = result_facts(surface, input.facts.mean_edge_length, smoothed, features);
  LabelledMesh& result = output.result;
  result.dihedral_rad = surface.upload_edges(std::move(features.dihedral_rad));
  result.mesh = {surface.upload_positions(std::move(smoothed.positions)), input.mesh.triangles};
  result.edges = input.topology.edges;
  result.labels = surface.upload_edges(std::move(smoothed.labels));
  features = surface.upload_features(std::move(features));
  if (!smoothed.sigma.empty()) {
    result.sigma = surface.upload_vertices(std::move(smoothed.sigma));
    output.facts.uncertainty = uncertainty_facts(result.sigma, input.facts.mean_edge_length);
  }
  result.classes = std::move(features.classes);
  result.segments = std::move(features.segments);
  result.ridge_lines = std::move(features.ridge_lines);
  result.corners = std::move(features.corners);
  warn_of_single_precision(result.mesh.positions, input.facts.mean_edge_length, output.warnings);
  output.sweeps = std::move(smoothed.sweeps);
  output.cancelled = smoothed.cancelled;
  if (const std::uint32_t nearby = surface.welded_nearby(); nearby > 0) {
    output.warnings.push_back({"vertices_welded_nearby",
                               fmt::format("{} vertices are within {} mean edge lengths of an earlier one: smoothed as "
                                           "one, returned at one position",
                                           nearby, options.weld_tolerance)});
  }
  return output;
}

}  // namespace crease
