#pragma once

#include <atomic>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"
#include "core/options/options.h"

namespace crease {

/// The terms of E(v, ε), each with its weight.
struct Energy {
  double likelihood = 0, smoothness = 0, sharpness = 0, support = 0;
  double curvature = 0;   ///< piecewise-quadratic prior
  double continuity = 0;  ///< of the dihedral angle along ridges
  double ridge_line = 0;  ///< straightness of ridges
  double total() const { return likelihood + smoothness + sharpness + support + curvature + continuity + ridge_line; }
};

/// What a sweep did.
struct SweepRecord {
  std::uint32_t sweep = 0;  ///< from 1, through all stages
  std::string_view stage;   ///< what was sampled beside the labels: "vertex" or "face"
  Energy energy;            ///< after the sweep, with the final weights α, β, γ, κ so that sweeps can be compared
  double likelihood_weight = 0;  ///< α, or the weight of the measured normals
  double temperature = 0, label_temperature = 0;
  double step_size = 0;  ///< in mean edge lengths, or in radians of a normal
  double acceptance = 0, label_acceptance = 0;
  std::uint32_t ridge_edges = 0;  ///< labels ≥ 0.5
  double rms_displacement = 0;    ///< in mean edge lengths
};

/// A view of a run between two sweeps; valid during the call only.
struct SweepView {
  const SweepRecord& record;
  std::uint32_t sweeps = 0;
  double seconds = 0;
  std::function<std::vector<double>()> labels;   ///< per edge of the topology, made when called
  std::function<std::vector<Vec3>()> positions;  ///< in the units of the upload, made when called
  std::function<std::string()> checkpoint = {};  ///< made when called; empty where a method has none
};

/// How a caller follows and stops a run. `on_sweep` is called after every sweep on the calling thread; when it returns
/// false, or `cancel` is set from any thread, the run ends before the next sweep and the result says `cancelled`.
struct RunContext {
  std::function<bool(const SweepView&)> on_sweep;
  std::atomic<bool> cancel{false};
  /// A checkpoint of a run of the same mesh, weights and options (threads may differ) by the same program: the run goes
  /// on from there, and ends with the bits that an undisturbed one ends with. Empty: from the start.
  std::string_view checkpoint;
};

struct SmoothResult {
  std::vector<Vec3> positions;
  std::vector<double> labels;  ///< per edge of the topology, in [0, 1]; 0 where the edge is not interior
  std::vector<SweepRecord> sweeps;
  std::uint64_t site_proposals = 0, label_proposals = 0;
  double seconds = 0;  ///< those before the checkpoint included
  bool cancelled = false;
};

/// Denoises `measured` by the method of the options: the coupled processes of §3.4, annealed (§3.5), or a classical
/// method as a run of one sweep per iteration without labels. `weights` of the likelihood per vertex, empty for 1
/// everywhere; a classical method has no use for them. The same mesh, options and seed give the same bits for any
/// number of threads, and through any number of checkpoints. \throw CheckpointError
SmoothResult smooth(const Mesh& measured, const Topology& topology, const SmoothOptions& options, RunContext& context,
                    std::span<const double> weights = {});

}  // namespace crease
