#include "core/smooth/smooth.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/io/encode.h"
#include "core/smooth/edge_process.h"
#include "core/smooth/field.h"
#include "core/smooth/renumbering.h"
#include "core/smooth/schedule.h"
#include "core/smooth/vertex_process.h"

namespace crease {
namespace {

/// Acceptance rate that the step size is steered to [Roberts et al. 1997 give 0.44 for one dimension, 0.23 for many].
constexpr double kTargetAcceptance = 0.4;
constexpr double kStepChange = 1.05;
/// The labels are averaged over the part of the annealing after this time.
constexpr double kAverageFrom = 0.85;
constexpr double kSmallestStep = 1e-5, kLargestStep = 1.0;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// From `start` to `end` as `time` goes from 0 to 1, geometrically; linearly where an end is zero.
double scheduled(double start, double end, double time) {
  return start > 0 && end > 0 ? start * std::pow(end / start, time) : start + (end - start) * time;
}

template <typename Value>
std::vector<Value> gathered(const std::vector<Value>& values, const std::vector<Index>& places) {
  std::vector<Value> result;
  result.reserve(places.size());
  for (const Index place : places) result.push_back(values[place]);
  return result;
}

Neighborhood neighborhood_of(const SmoothOptions& options) {
  const bool wide =
      options.curvature_weight > 0 || options.ridge_line_weight > 0 || options.likelihood == LikelihoodKind::kVolume;
  return wide ? Neighborhood::kWide : Neighborhood::kFirstOrder;
}

/// The annealing: all state between two sweeps.
class Annealing {
 public:
  Annealing(const Mesh& mesh, const Topology& topology, const SmoothOptions& options)
      : options_(options),
        mesh_(mesh),
        team_(options.threads),
        field_(mesh, topology, options),
        final_model_(EnergyModel::final_of(options)),
        vertex_schedule_(schedule_vertices(mesh, topology, neighborhood_of(options))),
        edge_schedule_(schedule_edges(topology)),
        vertex_process_(field_, vertex_schedule_, team_.size()),
        step_(options.step_size) {
    terms_.update(field_, final_model_, team_);
  }

  /// In the units of the upload.
  std::vector<Vec3> positions() const { return field_.upload_positions(mesh_); }
  const std::vector<double>& labels() const { return field_.labels; }

  /// The labels' expectation over the coldest sweeps: how probable a ridge is, where one sample would be a throw of it.
  std::vector<double> expected_labels() const {
    std::vector<double> labels = field_.labels;
    if (averaged_sweeps_ == 0) return labels;
    for (std::size_t e = 0; e < labels.size(); ++e) labels[e] = label_sums_[e] / averaged_sweeps_;
    return labels;
  }

  SweepRecord sweep(std::uint32_t index) {
    const double time = options_.sweeps > 1 ? static_cast<double>(index - 1) / (options_.sweeps - 1) : 1.0;
    EnergyModel model = final_model_;
    model.likelihood_weight = scheduled(options_.likelihood_weight_start, options_.likelihood_weight, time);
    SweepRecord record;
    record.sweep = index;
    record.likelihood_weight = model.likelihood_weight;
    record.label_temperature = scheduled(options_.label_temperature_start, options_.label_temperature_end, time);
    record.vertex_temperature = scheduled(options_.vertex_temperature_start, options_.vertex_temperature_end, time);
    record.step_size = step_;
    if (options_.edge_process) {
      EdgeProcess edges(field_, terms_, model);
      record.label_acceptance =
          edges.sweep(edge_schedule_, edge_random_, index, record.label_temperature, team_).acceptance();
      if (time >= kAverageFrom) average_labels();
    }
    vertex_process_.set_model(model, team_);
    record.vertex_acceptance =
        vertex_process_.sweep(vertex_random_, index, record.vertex_temperature, step_, team_).acceptance();
    adapt_step(record.vertex_acceptance);
    terms_.update(field_, final_model_, team_);
    measure(record);
    return record;
  }

  std::uint64_t vertex_sites() const { return vertex_schedule_.sites.size(); }
  std::uint64_t edge_sites() const { return options_.edge_process ? edge_schedule_.sites.size() : 0; }

 private:
  void average_labels() {
    label_sums_.resize(field_.labels.size(), 0);
    team_.run(label_sums_.size(), 8192, [&](std::size_t begin, std::size_t end, std::size_t) {
      for (std::size_t e = begin; e < end; ++e) label_sums_[e] += field_.labels[e];
    });
    ++averaged_sweeps_;
  }

  void adapt_step(double acceptance) {
    const double wanted = acceptance > kTargetAcceptance ? step_ * kStepChange : step_ / kStepChange;
    step_ = std::clamp(wanted, kSmallestStep, kLargestStep);
  }

  void measure(SweepRecord& record) {
    record.energy = energy(field_, terms_, final_model_, team_);
    record.ridge_edges = block_sum<std::uint32_t>(
        field_.labels.size(), team_, [&](std::size_t e) { return field_.labels[e] >= kRidgeThreshold ? 1U : 0U; });
    const auto squares = block_sum<double>(field_.positions.size(), team_, [&](std::size_t v) {
      return (field_.positions[v] - field_.measured[v]).squaredNorm();
    });
    record.rms_displacement = std::sqrt(squares / static_cast<double>(field_.positions.size()));
  }

  const SmoothOptions& options_;
  const Mesh& mesh_;
  ThreadTeam team_;
  Field field_;
  EdgeTerms terms_;
  EnergyModel final_model_;
  Schedule vertex_schedule_, edge_schedule_;
  VertexProcess vertex_process_;
  CounterRandom vertex_random_{options_.seed, RandomStream::kVertexProcess};
  CounterRandom edge_random_{options_.seed, RandomStream::kEdgeProcess};
  double step_;
  std::vector<double> label_sums_;
  std::uint32_t averaged_sweeps_ = 0;
};

}  // namespace

SmoothResult smooth(const Mesh& measured, const Topology& topology, const SmoothOptions& options, RunContext& context) {
  const auto start = std::chrono::steady_clock::now();
  const Renumbering renumbering(measured);
  Topology renumbered = build_topology(renumbering.mesh);
  const std::vector<Index> edges = new_edges(renumbering, topology, renumbered);
  adopt_orientation(topology, renumbering.new_face, edges, renumbered);
  Annealing annealing(renumbering.mesh, renumbered, options);
  const auto positions = [&] { return gathered(annealing.positions(), renumbering.new_vertex); };

  SmoothResult result;
  for (std::uint32_t index = 1; index <= options.sweeps && !result.cancelled; ++index) {
    result.sweeps.push_back(annealing.sweep(index));
    result.vertex_proposals += annealing.vertex_sites();
    result.label_proposals += annealing.edge_sites();
    if (context.on_sweep) {
      const auto labels = [&] { return gathered(annealing.labels(), edges); };
      result.cancelled =
          !context.on_sweep({result.sweeps.back(), options.sweeps, seconds_since(start), labels, positions});
    }
    result.cancelled = result.cancelled || context.cancel.load();
  }
  result.positions = positions();
  result.labels = gathered(annealing.expected_labels(), edges);
  result.seconds = seconds_since(start);
  return result;
}

}  // namespace crease
