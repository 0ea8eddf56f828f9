#pragma once

#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "core/base/state_archive.h"
#include "core/solve/edge_process.h"
#include "core/solve/run.h"

namespace crease {

/// From `start` to `end` as `time` goes from 0 to 1, geometrically; linearly where an end is zero.
double scheduled(double start, double end, double time);

/// The state that all stages of a run work on, and the edge process that each of their sweeps begins with.
class Annealing {
 public:
  /// `threads` 0: as many as the machine has. `weights` of the likelihood per vertex of `measured`, empty for 1
  /// everywhere. Mesh, topology and options must
  /// outlive the object.
  Annealing(const Mesh& measured, const Topology& topology, const MrfOptions& run_options, std::uint32_t threads,
            std::span<const double> weights);

  const MrfOptions& options;
  const Mesh& mesh;
  ThreadTeam team;
  Field field;
  EnergyTerms terms;

  /// One pass over the labels by the solver of the options, at its temperature for `time` in [0, 1].
  void label_edges(const Weights& weights, std::uint32_t sweep, double time, SweepRecord& record);
  /// Energy with the final weights, ridges and displacement as they are now.
  void measure(SweepRecord& record);
  /// Brings what the edge process sees up to date with positions and normals.
  void positions_changed();

  /// The labels' expectation over the coldest sweeps of a stage: how probable a ridge is, where one sample would be a
  /// throw of it.
  std::vector<double> expected_labels() const;
  /// What sweeps change. Read from a checkpoint, it is followed by what is made from it.
  void exchange(StateArchive& archive);
  /// Forgets the average when a new stage begins.
  void restart_average();
  std::uint64_t edge_sites() const { return options.edge_process ? edge_schedule_.sites.size() : 0; }

 private:
  void average_labels();

  Schedule edge_schedule_;
  std::vector<double> label_sums_;
  std::uint32_t averaged_sweeps_ = 0;
};

/// A part of a run: the labels beside one other field.
class Stage {
 public:
  virtual ~Stage() = default;
  virtual std::uint32_t sweeps() const = 0;
  virtual std::uint64_t sites() const = 0;
  /// Sweep `index` of the stage, from 0; `number` counts all sweeps of the run and keys the random numbers.
  /// Returns whether more sweeps may gain something.
  virtual bool sweep(std::uint32_t index, std::uint32_t number, SweepRecord& record) = 0;
  /// What sweeps change beside the state that all stages share.
  virtual void exchange(StateArchive& archive) = 0;
};

/// Positions are sampled (§3.2), or moved down the gradient.
std::unique_ptr<Stage> make_vertex_stage(Annealing& annealing, std::uint32_t sweeps);
/// Face normals in rounds, each ending in a fit of the vertices (§5, Fig. 6).
std::unique_ptr<Stage> make_face_stage(Annealing& annealing, std::uint32_t sweeps);

}  // namespace crease
