#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/choice/report.h"
#include "core/energy/terms.h"

namespace crease {

/// What a sweep's record calls its stage.
inline constexpr std::string_view kFaceStage = "face", kVertexStage = "vertex", kChoiceStage = "choice",
                                  kClassicalStage = "classical";

/// What a sweep did.
struct SweepRecord {
  std::uint32_t sweep = 0;       ///< from 1, through all stages
  std::string_view stage;        ///< one of the above; "choice" tries candidates of the automatic setting
  Energy energy;                 ///< after the sweep, with the final weights so that sweeps can be compared
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
  std::function<std::vector<double>()> labels;             ///< per edge of the topology, made when called
  std::function<std::vector<Vec3>()> positions;            ///< in the units of the upload, made when called
  std::function<std::string()> checkpoint = {};            ///< made when called; empty where a method has none
  std::function<std::vector<double>()> dihedral_rad = {};  ///< per edge, for `positions`; set by run_job
  std::optional<double> fraction = {};                     ///< of the work that is done, where sweeps take unlike times
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
  std::optional<ChoiceReport> choice;  ///< of solver=descent; where components are smoothed apart, that of the largest
  std::vector<ChoiceReport> other_choices;  ///< of the other components that are smoothed apart
  std::vector<double>
      sigma;  ///< standard deviation of each vertex along its normal, in the units of the upload; or empty
};

}  // namespace crease
