#pragma once

#include <cstdint>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/classical/classical.h"
#include "core/mesh/mesh.h"

namespace crease {

enum class Smoothness {
  kQuadratic,   ///< ρ(x) = ‖x‖² [Szeliski & Tonnesen 1992]
  kSquareRoot,  ///< ρ(x) = ‖x‖ [Diebel et al. 2006]
  kHuber,       ///< ‖x‖² up to a width δ, then 2δ‖x‖ − δ² [Huber 1964]
  kTruncated,   ///< min(‖x‖², δ²) [Blake & Zisserman 1987]
};

enum class LikelihoodKind {
  kQuadratic,    ///< ‖v⁰ − v‖²: isotropic Gaussian noise
  kHuber,        ///< quadratic up to a width, then linear: outliers [Huber 1964]
  kAnisotropic,  ///< noise along a scanner's direction or the vertex normal, little across it
  kVolume,       ///< quadratic, and a neighbourhood must not sweep volume on the whole
};

/// Which edges the edge process may label (§5, Fig. 5).
enum class RidgeKind { kAll, kConvex, kConcave };

enum class Process {
  kVertex,  ///< positions are sampled (§3.2)
  kFace,    ///< face normals are sampled, then vertices are fitted to them (§5, Fig. 6)
  kBoth,    ///< face rounds, then vertex sweeps from where they end
};

enum class Solver {
  kMetropolis,  ///< §3.5
  kMeanField,   ///< deterministic annealing
};

/// How to smooth. Lengths in mean edge lengths of the measured mesh, angles in radians, energies without unit.
/// Meaning, range and default of each field for users are in proto/crease/v1/parameters.proto; a test holds the
/// defaults of both together.
struct SmoothOptions {
  std::optional<ClassicalMethod> classical_method;  ///< instead of the Markov random field; all below is not read then
  ClassicalOptions classical;

  Process process = Process::kBoth;
  Solver solver = Solver::kMetropolis;
  std::uint32_t sweeps = 1000;  ///< of all processes; kBoth takes half for each
  std::uint32_t seed = 1;
  std::uint32_t threads = 0;  ///< 0: as many as the machine has; never changes the result

  LikelihoodKind likelihood = LikelihoodKind::kQuadratic;
  double likelihood_weight = 0.15;       ///< α at the end of the annealing
  double likelihood_weight_start = 3.0;  ///< α at the start
  double likelihood_width = 0.3;         ///< kHuber: where it turns linear
  Vec3 scan_direction = Vec3::Zero();    ///< kAnisotropic: along which the noise is; zero: the vertex normal
  double likelihood_across = 10.0;       ///< kAnisotropic: cost of ‖x‖² across the direction, relative to along it
  double volume_weight = 20.0;           ///< kVolume: of the squared mean displacement along the normals

  Smoothness smoothness = Smoothness::kQuadratic;
  double smoothness_weight = 1.0;                           ///< β
  double smoothness_width = 20 * (std::numbers::pi / 180);  ///< δ of kHuber and kTruncated
  double curvature_weight = 0.0;                            ///< of the piecewise-quadratic prior

  bool edge_process = true;  ///< false: all labels stay 0, the paper's model without ridges
  double sharpness_threshold = 46 * (std::numbers::pi / 180);  ///< φ₀
  double sharpness_weight = 0.6;                               ///< γ, per radian
  double support_weight = 0.25;                                ///< κ, relative to γ
  RidgeKind ridge_kind = RidgeKind::kAll;
  double sharpness_limit = 180 * (std::numbers::pi / 180);  ///< edges beyond are no ridges
  double continuity_weight = 0.0;                           ///< of the change of φ along a ridge, per squared radian
  double ridge_line_weight = 0.0;                           ///< of the second difference of positions along a ridge

  std::uint32_t rounds = 10;    ///< of the face process: anneal the normals, fit the vertices, measure again
  std::uint32_t fit_steps = 2;  ///< of the vertices at the end of a round
  double normal_weight = 0.2;   ///< of the measured normals
  double corner_weight = 0.0;   ///< of faces that share a vertex only, relative to neighbours across an edge
  double normal_temperature_start = 0.03, normal_temperature_end = 0.00002;

  double label_temperature_start = 0.3, label_temperature_end = 0.022;
  double vertex_temperature_start = 0.1, vertex_temperature_end = 0.0005;
  double step_size = 0.1;  ///< half-width of a proposal at the start; adapts to the acceptance rate
};

using OptionValue = std::variant<bool, std::uint32_t, double, std::string>;

/// Sets the field that the API calls `name`; angles named `_deg` are converted to radians.
/// \throw Error parameter_unknown, parameter_invalid
void set_option(SmoothOptions& options, std::string_view name, const OptionValue& value);

/// Every option under its API name, in the units of the API.
std::vector<std::pair<std::string, OptionValue>> option_values(const SmoothOptions& options);

}  // namespace crease
