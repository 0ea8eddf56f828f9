#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/choice/error_model.h"
#include "core/choice/expected_error.h"
#include "core/choice/features.h"

namespace crease {

/// The features that depend on what a setting made of the mesh.
inline constexpr std::size_t kLookFeatures = 31;
using Look = std::array<double, kLookFeatures>;
Look look_of(const Features& features);

/// Mean angle between unit vectors of the same number.
double mean_angle_deg(std::span<const float> some, std::span<const float> others);

/// A setting that was tried, beside others.
struct TriedSetting {
  std::size_t setting = 0;    ///< in kSettings
  double expected_error = 0;  ///< before it was tried
  Look look{};                ///< of its result
  double from_reference = 0;  ///< mean angle between the normals of its result and of the reference, in degrees
  double from_others = 0;     ///< the same, averaged over all that were tried
};

/// At most so many settings are tried, and none that is expected to be worse than the best by more than this.
inline constexpr std::size_t kMostTried = 4;
inline constexpr double kLikely = 0.1;

/// The settings with the smallest expected errors, best first; at most `most`, which is at least 1.
std::vector<std::size_t> likely_settings(const SettingErrors& errors, std::size_t most = kMostTried);

/// Solves some of kSettings on the whole schedule, with what is known of the noise.
std::vector<TriedSetting> try_settings(std::span<const std::size_t> settings, const SettingErrors& expected,
                                       const FlatMesh& mesh, const Evidence& evidence, const Solve& solve);

/// Of the logarithm of the error of a setting over the geometric mean of those that were tried beside it: a line, and
/// what a kernel adds to it.
struct SecondLookModel : ErrorModel<4 + kLookFeatures + kFeatures + 2, 1, Kernel::kExponential> {
  Features slopes{};  ///< per standard deviation

  double along_slopes(const Description& description) const;
  double expected_error(const Features& features) const;
};

/// What SecondLookModel sees of each setting: how it differs from the mean of those tried, and what the upload is like.
std::vector<SecondLookModel::Features> second_features(const Features& first, std::span<const TriedSetting> tried);

/// The model that was fitted on the training pairs of tests/quality (tests/quality/fit_second_look.cpp).
extern const SecondLookModel kSecondLook;

}  // namespace crease
