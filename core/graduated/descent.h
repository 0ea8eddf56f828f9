#pragma once

#include <functional>
#include <span>

#include "core/graduated/energy.h"
#include "core/graduated/hinge_metric.h"
#include "core/graduated/latent_variance.h"
#include "core/graduated/lbfgs.h"
#include "core/graduated/potential.h"

namespace crease {

/// Length below which an edge counts no less, in ℓ.
inline constexpr float kLeastEdge = 0.05F;

/// What a descent is told.
struct GraduatedOptions {
  PotentialFamily family;
  float weight = 0.1F;     ///< of the likelihood, times the noise variance
  float variance = 0.09F;  ///< of the noise along normals, in ℓ²
  float across = 16;       ///< t: above 1 for noise along normals, 1 for isotropic noise
  float across_start = 6;  ///< at most; anneals to `across` where that is above 1
  float irregularity = 0;  ///< deviation of vertices from the mean of their neighbours, within the surface, without
                           ///< noise, in ℓ; 0 for noise along normals, which leaves the sampling as it is
  float fading_area_start = 0.4F;
  float fold_weight = 3, fold_area = 0.3F;
  bool latent_variance = true;    ///< tell vertices that hardly moved from those that did
  int stages = 6, steps = 35;     ///< stages, and the most steps in each
  bool goes_on = false;           ///< begin a stage with the last step of the one before
  HingeMetric* metric = nullptr;  ///< first metric of the searches, for this mesh; null: the curvature per vertex
};

/// Where a descent ends, and what it learnt of the noise.
struct GraduatedResult {
  FlatVectors positions;
  FlatVectors vertex_normals;
  LatentVariance latent;
  GraduatedEnergy::Parts energy;
};

/// A stage that has been done.
struct StageView {
  int stage = 0;  ///< from 0
  const GraduatedEnergy& energy;
  std::span<const float> positions;
  const LatentVariance& latent;
  const LbfgsStep& last_step;  ///< none unless the next stage begins with it
};

/// Returns false to end the descent early.
using StageObserver = std::function<bool(const StageView&)>;

/// Minimises GraduatedEnergy from the measured positions by graduated non-convexity [Blake & Zisserman 1987]: in each
/// stage the potential, its scales, the soft normals and the references are brought up to date and then stand still
/// while L-BFGS goes down.
class GraduatedDescent {
 public:
  /// `precisions` of the likelihood per vertex, relative; empty for 1. `latent` overrules them and the estimate of the
  /// latent variance. All must outlive the object.
  GraduatedDescent(const FlatMesh& mesh, std::span<const float> measured, const GraduatedOptions& options,
                   std::span<const float> precisions, std::span<const float> latent, ThreadTeam& team);

  /// From the measured positions, or, after `resume`, from a stage on.
  GraduatedResult run(const StageObserver& observer = {});

  /// Goes on from `positions` with stage number `stage`. `last_step` is that of the stage before.
  void resume(int stage, FlatVectors positions, LbfgsStep last_step = {});

 private:
  void begin_stage(int stage);
  void update_metric();
  void update_normals();
  void update_references();
  void update_scales(float scale);
  void even_sampling();
  void update_precisions(int stage);
  void restore_unmoved();

  const FlatMesh& mesh_;
  std::span<const float> measured_, given_precisions_, given_latent_;
  GraduatedOptions options_;
  ThreadTeam& team_;
  GraduatedEnergy energy_;
  FlatVectors positions_, area_vectors_;
  LbfgsMemory memory_;
  FlatVectors smoothed_;                   ///< by the stage before, for families that diffuse
  FlatVectors evened_;                     ///< what was measured or smoothed, moved within the surface
  std::vector<float> inverse_curvatures_;  ///< of the stage, a number for each of `positions_`
  LatentVariance latent_;
  int first_stage_ = 0;
};

}  // namespace crease
