#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <string_view>
#include <variant>

#include "core/mesh/mesh.h"

namespace crease {

inline constexpr double kDegree = std::numbers::pi / 180;

// The choices of the options, each with the words for its values in their order.

enum class Smoothness {
  kQuadratic,   ///< ρ(x) = ‖x‖² [Szeliski & Tonnesen 1992]
  kSquareRoot,  ///< ρ(x) = ‖x‖ [Diebel et al. 2006]
  kHuber,       ///< ‖x‖² up to a width δ, then 2δ‖x‖ − δ² [Huber 1964]
  kTruncated,   ///< min(‖x‖², δ²) [Blake & Zisserman 1987]
};

constexpr std::array<std::string_view, 4> words_of(Smoothness) {
  return {"quadratic", "square_root", "huber", "truncated"};
}

enum class LikelihoodKind {
  kQuadratic,    ///< ‖v⁰ − v‖²: isotropic Gaussian noise
  kHuber,        ///< quadratic up to a width, then linear: outliers [Huber 1964]
  kAnisotropic,  ///< noise along a scanner's direction or the vertex normal, little across it
  kVolume,       ///< quadratic, and a neighbourhood must not sweep volume on the whole
};

constexpr std::array<std::string_view, 4> words_of(LikelihoodKind) {
  return {"quadratic", "huber", "anisotropic", "volume"};
}

/// Which edges the edge process may label (§5, Fig. 5).
enum class RidgeKind { kAll, kConvex, kConcave };

constexpr std::array<std::string_view, 3> words_of(RidgeKind) { return {"all", "convex", "concave"}; }

enum class Process {
  kVertex,  ///< positions are sampled (§3.2)
  kFace,    ///< face normals are sampled, then vertices are fitted to them (§5, Fig. 6)
  kBoth,    ///< face rounds, then vertex sweeps from where they end
};

constexpr std::array<std::string_view, 3> words_of(Process) { return {"vertex", "face", "both"}; }

enum class Solver {
  kDescent,     ///< labels minimised out, everything estimated: the automatic setting
  kMetropolis,  ///< §3.5
};

constexpr std::array<std::string_view, 2> words_of(Solver) { return {"descent", "metropolis"}; }

/// What the automatic setting is told of the noise.
enum class NoiseOption { kEstimated, kNormal, kIsotropic, kCorrelated };

constexpr std::array<std::string_view, 4> words_of(NoiseOption) {
  return {"estimated", "normal", "isotropic", "correlated"};
}

/// What the automatic setting is told of the surface; the words are the names of families in core/choice/families.h.
enum class SurfaceOption {
  kEstimated,
  kCreases,
  kCurvedCreases,
  kFlats,
  kOrganic,
};

constexpr std::array<std::string_view, 5> words_of(SurfaceOption) {
  return {"estimated", "creases", "curved_creases", "flats", "organic"};
}

// Each method has a struct of its own, with the options that it reads and their defaults. Lengths are in ℓ, the mean
// edge length of the measured mesh, angles in radians, energies without unit. Ranges, meanings and the names that
// users know are in core/options/parameter_rows.cpp.

/// Markov random fields: the method of the paper.
struct MrfOptions {
  static constexpr std::string_view kName = "mrf";

  Process process = Process::kBoth;
  Solver solver = Solver::kDescent;

  double strength = 1;     ///< descent: of smoothing; 0 leaves the upload as it is
  double noise_sigma = 0;  ///< descent: deviation of the noise; 0: estimated
  NoiseOption noise = NoiseOption::kEstimated;
  SurfaceOption surface = SurfaceOption::kEstimated;
  bool uncertainty = false;  ///< descent: estimate how far each vertex of the result may be off

  std::uint32_t sweeps = 1000;  ///< of all processes; kBoth takes half for each
  std::uint32_t seed = 1;

  LikelihoodKind likelihood = LikelihoodKind::kQuadratic;
  double likelihood_weight = 0.15;       ///< α at the end of the annealing
  double likelihood_weight_start = 3.0;  ///< α at the start
  double likelihood_width = 0.3;         ///< kHuber: where it turns linear
  Vec3 scan_direction = Vec3::Zero();    ///< kAnisotropic: along which the noise is; zero: the vertex normal
  double likelihood_across = 10.0;       ///< kAnisotropic: cost of ‖x‖² across the direction, relative to along it
  double volume_weight = 20.0;           ///< kVolume: of the squared mean displacement along the normals

  Smoothness smoothness = Smoothness::kQuadratic;
  double smoothness_weight = 1.0;          ///< β
  double smoothness_width = 20 * kDegree;  ///< δ of kHuber and kTruncated
  double curvature_weight = 0.0;           ///< of the piecewise-quadratic prior

  bool edge_process = true;                   ///< false: all labels stay 0, the paper's model without ridges
  double sharpness_threshold = 46 * kDegree;  ///< φ₀
  double sharpness_weight = 0.6;              ///< γ, per radian
  double support_weight = 0.25;               ///< κ, relative to γ
  RidgeKind ridge_kind = RidgeKind::kAll;
  double sharpness_limit = 180 * kDegree;  ///< edges beyond are no ridges
  double continuity_weight = 0.0;          ///< of the change of φ along a ridge, per squared radian
  double ridge_line_weight = 0.0;          ///< of the second difference of positions along a ridge

  std::uint32_t rounds = 10;    ///< of the face process: anneal the normals, fit the vertices, measure again
  std::uint32_t fit_steps = 2;  ///< of the vertices at the end of a round
  double normal_weight = 0.2;   ///< of the measured normals
  double corner_weight = 0.0;   ///< of faces that share a vertex only, relative to neighbours across an edge
  double normal_temperature_start = 0.03, normal_temperature_end = 0.00002;

  double label_temperature_start = 0.3, label_temperature_end = 0.022;
  double vertex_temperature_start = 0.1, vertex_temperature_end = 0.0005;
  double step_size = 0.1;  ///< half-width of a proposal at the start; adapts to the acceptance rate

  /// Positions go down the gradient instead of being sampled. Set by Diebel's method, not by users.
  bool conjugate_gradients = false;
  /// Vertices at boundaries and non-manifold edges keep their places in descent. Set by Diebel's method, not by users.
  bool boundaries_stay = false;
};

/// Face normals become fuzzy vector medians, vertices follow [Shen & Barner 2004].
struct FuzzyVectorMedianOptions {
  static constexpr std::string_view kName = "fuzzy_vector_median";
  std::uint32_t iterations = 10;       ///< each filters all normals and then moves the vertices
  double normal_width = 20 * kDegree;  ///< spread of the membership function
  std::uint32_t fitting_steps = 5;     ///< in which the vertices follow the filtered normals
};

/// λ|μ: a low-pass filter that does not shrink [Taubin 1995].
struct TaubinOptions {
  static constexpr std::string_view kName = "taubin";
  std::uint32_t iterations = 15;
  double step = 0.6307;   ///< the positive factor λ
  double passband = 0.1;  ///< k = 1/λ + 1/μ; it fixes the negative factor μ
};

/// Implicit steps of dx/dt = Δx with cotangent weights [Desbrun et al. 1999].
struct MeanCurvatureFlowOptions {
  static constexpr std::string_view kName = "mean_curvature_flow";
  std::uint32_t iterations = 5;
  double step = 0.1;  ///< of time, in ℓ²
};

/// The same, slowed at features by principal curvatures [Desbrun et al. 2000, Meyer et al. 2003].
struct AnisotropicFlowOptions {
  static constexpr std::string_view kName = "anisotropic_flow";
  std::uint32_t iterations = 10;
  double step = 0.1;                   ///< of time, in ℓ²
  double normal_width = 80 * kDegree;  ///< curvature threshold T, in radians per ℓ
};

/// Face normals diffuse anisotropically, vertices follow [Tasdizen et al. 2002].
struct NormalDiffusionOptions {
  static constexpr std::string_view kName = "normal_diffusion";
  std::uint32_t iterations = 5;        ///< each filters all normals and then moves the vertices
  double step = 2;                     ///< diffusion time of the normals in an iteration
  double normal_width = 20 * kDegree;  ///< width of the conductance
  std::uint32_t fitting_steps = 20;    ///< in which the vertices follow the filtered normals
};

/// Robust mean of first-order predictors, in one pass [Jones, Durand & Desbrun 2003].
struct NonIterativeOptions {
  static constexpr std::string_view kName = "non_iterative";
  double spatial_width = 1.5;  ///< σ_f: of the spatial Gaussian in ℓ, cut off at two widths
  double range_width = 0.7;    ///< σ_g: of the Gaussian of predictions in ℓ
};

/// Bilateral filter of heights over tangent planes [Fleishman, Drori & Cohen-Or 2003].
struct BilateralOptions {
  static constexpr std::string_view kName = "bilateral";
  std::uint32_t iterations = 3;
  double spatial_width = 1;  ///< σ_c: of the spatial Gaussian in ℓ, cut off at two widths
  double range_width = 0.3;  ///< σ_s: of the Gaussian of heights in ℓ
};

/// Square-root prior on normals and a likelihood, by conjugate gradients [Diebel et al. 2006].
struct DiebelOptions {
  static constexpr std::string_view kName = "diebel";
  std::uint32_t iterations = 150;  ///< steps of conjugate gradients
  double likelihood_weight = 2;    ///< of ‖v⁰ − v‖²/ℓ² against ‖n_i − n_j‖
};

/// The paper's method and those that it is compared with (§1, Fig. 4).
using Method =
    std::variant<MrfOptions, FuzzyVectorMedianOptions, TaubinOptions, MeanCurvatureFlowOptions, AnisotropicFlowOptions,
                 NormalDiffusionOptions, NonIterativeOptions, BilateralOptions, DiebelOptions>;

/// A method with its defaults, by its index in Method.
Method default_method(std::size_t index);

/// How to smooth.
struct SmoothOptions {
  Method method;
  std::uint32_t threads = 0;  ///< 0: as many as the machine has; never changes the result
  double weld_tolerance = 0;  ///< vertices this near, in ℓ, are smoothed as one; 0: exactly coincident ones
};

/// Everything that a job has parameters for.
struct JobOptions {
  SmoothOptions smooth;
  double retention_hours = 24;  ///< that a service keeps the job after its end
};

}  // namespace crease
