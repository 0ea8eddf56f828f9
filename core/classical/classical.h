#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease {

/// The methods that the paper's smoothing is compared with (§1, Fig. 4), by who published them.
enum class ClassicalMethod {
  kFuzzyVectorMedian,  ///< face normals become fuzzy vector medians, vertices follow [Shen & Barner 2004]
  kTaubin,             ///< λ|μ: a low-pass filter that does not shrink [Taubin 1995]
  kMeanCurvatureFlow,  ///< implicit steps of dx/dt = Δx with cotangent weights [Desbrun et al. 1999]
  kAnisotropicFlow,  ///< the same, slowed at features by principal curvatures [Desbrun et al. 2000, Meyer et al. 2003]
  kNormalDiffusion,  ///< face normals diffuse anisotropically, vertices follow [Tasdizen et al. 2002]
  kNonIterative,     ///< robust mean of first-order predictors [Jones, Durand & Desbrun 2003]
  kBilateral,        ///< bilateral filter of heights over tangent planes [Fleishman, Drori & Cohen-Or 2003]
  kDiebel,           ///< square-root prior on normals and a likelihood, conjugate gradients [Diebel et al. 2006]
};

/// How to run a method. 0 is the method's own default, see default_options. A method does not look at the fields that
/// it is not named for. ℓ is the mean edge length of the measured mesh; angles are in radians.
struct ClassicalOptions {
  /// Passes, steps of the flow, or steps of conjugate gradients: 1 to 100000. All but kNonIterative, which has one
  /// pass. For kFuzzyVectorMedian and kNormalDiffusion one iteration filters all normals and then moves the vertices.
  std::uint32_t iterations = 0;

  /// kTaubin: the positive factor λ, up to 0.65. kMeanCurvatureFlow, kAnisotropicFlow: time step in ℓ², up to 100.
  /// kNormalDiffusion: diffusion time of the normals in an iteration, up to 1000.
  double step = 0;

  /// kTaubin: pass-band frequency k = 1/λ + 1/μ, up to 0.5; it fixes the negative factor μ.
  double passband = 0;

  /// kBilateral: σ_c, kNonIterative: σ_f: width of the spatial Gaussian in ℓ, 0.1 to 20. Cut off at two widths.
  double spatial_width = 0;

  /// kBilateral: σ_s, kNonIterative: σ_g: width of the Gaussian of heights or predictions in ℓ, 0.001 to 100.
  double range_width = 0;

  /// Angle beyond which a difference counts as a feature, 0.001 to π. kFuzzyVectorMedian: spread of the membership
  /// function. kNormalDiffusion: width of the conductance. kAnisotropicFlow: curvature threshold T in radians per ℓ.
  double normal_width = 0;

  /// Steps in which the vertices follow the filtered normals, 1 to 1000. kFuzzyVectorMedian, kNormalDiffusion.
  std::uint32_t fitting_steps = 0;

  /// kDiebel: weight of ‖v⁰ − v‖²/ℓ² against ‖n_i − n_j‖, 0.0001 to 1000.
  double likelihood_weight = 0;
};

/// The method's own defaults; 0 in the fields that it does not read.
ClassicalOptions default_options(ClassicalMethod method);

struct ClassicalResult {
  std::vector<Vec3> positions;   ///< in the units of the upload; vertices that did not move come back exactly
  std::uint32_t iterations = 0;  ///< fewer than asked for when cancelled or converged
  double seconds = 0;
  bool cancelled = false;
};

/// A view of a run after an iteration; valid during the call only.
struct ClassicalView {
  std::uint32_t iteration = 0;   ///< from 1
  std::uint32_t iterations = 0;  ///< how many there are to be
  double seconds = 0;
  std::function<std::vector<Vec3>()> positions;  ///< in the units of the upload, made when called
};

/// Called after every iteration. Returns false to stop.
using ClassicalCallback = std::function<bool(const ClassicalView&)>;

/// Denoises `measured` by `method`. Boundaries and non-manifold edges stay: their vertices do not move and nothing is
/// smoothed across them. The same input gives the same bits; moving, turning or scaling it does so to the result.
ClassicalResult denoise(const Mesh& measured, const Topology& topology, ClassicalMethod method,
                        const ClassicalOptions& options = {}, const ClassicalCallback& on_iteration = {});

}  // namespace crease
