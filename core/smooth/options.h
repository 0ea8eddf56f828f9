#pragma once

#include <cstdint>
#include <numbers>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace crease {

enum class Smoothness {
  kQuadratic,   ///< ρ(x) = ‖x‖² [Szeliski & Tonnesen 1992]
  kSquareRoot,  ///< ρ(x) = ‖x‖ [Diebel et al. 2006]
};

/// How to smooth. Lengths in mean edge lengths of the measured mesh, angles in radians, energies without unit.
/// Meaning, range and default of each field for users are in proto/crease/v1/parameters.proto; a test holds the
/// defaults of both together.
struct SmoothOptions {
  std::uint32_t sweeps = 500;
  std::uint32_t seed = 1;
  std::uint32_t threads = 0;  ///< 0: as many as the machine has; never changes the result

  double likelihood_weight = 0.15;       ///< α at the end of the annealing
  double likelihood_weight_start = 3.0;  ///< α at the start
  Smoothness smoothness = Smoothness::kQuadratic;
  double smoothness_weight = 1.0;  ///< β

  bool edge_process = true;  ///< false: all labels stay 0, the paper's model without ridges
  double sharpness_threshold = 46 * (std::numbers::pi / 180);  ///< φ₀
  double sharpness_weight = 0.6;                               ///< γ, per radian
  double support_weight = 0.25;                                ///< κ, relative to γ

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
