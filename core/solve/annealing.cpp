#include "core/solve/annealing.h"

#include <cmath>

namespace crease {
namespace {

/// The labels are averaged over the part of a stage after this time.
constexpr double kAverageFrom = 0.85;

}  // namespace

double scheduled(double start, double end, double time) {
  return start > 0 && end > 0 ? start * std::pow(end / start, time) : start + (end - start) * time;
}

Annealing::Annealing(const Mesh& measured, const Topology& topology, const MrfOptions& run_options,
                     std::uint32_t threads, std::span<const double> weights)
    : options(run_options),
      mesh(measured),
      team(threads, measured.triangles.size()),
      field(mesh, topology),
      terms({field, options, weights}),
      edge_schedule_(schedule_edges(topology)) {
  positions_changed();
  terms.labels_changed(field, team);
}

void Annealing::positions_changed() {
  field.update_edges(team, options.edge_process);
  terms.positions_changed(field, team);
}

void Annealing::label_edges(const Weights& weights, std::uint32_t sweep, double time, SweepRecord& record) {
  record.label_temperature = scheduled(options.label_temperature_start, options.label_temperature_end, time);
  if (!options.edge_process) return;
  const CounterRandom random(options.seed, RandomStream::kEdgeProcess);
  EdgeProcess edges(field, terms, weights);
  record.label_acceptance = edges.sweep(edge_schedule_, random, sweep, record.label_temperature, team).acceptance();
  if (time >= kAverageFrom) average_labels();
  terms.labels_changed(field, team);
}

void Annealing::measure(SweepRecord& record) {
  record.energy = terms.energy(field, terms.final_weights(), team);
  record.ridge_edges = block_sum<std::uint32_t>(field.labels.size(), team,
                                                [&](std::size_t e) { return is_ridge(field.labels[e]) ? 1U : 0U; });
  const auto squares = block_sum<double>(field.positions.size(), team, [&](std::size_t v) {
    return (field.positions[v] - field.measured[v]).squaredNorm();
  });
  record.rms_displacement = std::sqrt(squares / static_cast<double>(field.positions.size()));
}

std::vector<double> Annealing::expected_labels() const {
  std::vector<double> labels = field.labels;
  if (averaged_sweeps_ == 0) return labels;
  for (std::size_t e = 0; e < labels.size(); ++e) labels[e] = label_sums_[e] / averaged_sweeps_;
  return labels;
}

void Annealing::exchange(StateArchive& archive) {
  archive.values(field.positions);
  archive.values(field.normals);
  archive.values(field.labels);
  archive.values_or_none(label_sums_, field.labels.size());
  archive.value(averaged_sweeps_);
  if (!archive.reading()) return;
  positions_changed();
  terms.labels_changed(field, team);
}

void Annealing::restart_average() {
  label_sums_.clear();
  averaged_sweeps_ = 0;
}

void Annealing::average_labels() {
  label_sums_.resize(field.labels.size(), 0);
  team.run(label_sums_.size(), kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t e = begin; e < end; ++e) label_sums_[e] += field.labels[e];
  });
  ++averaged_sweeps_;
}

}  // namespace crease
