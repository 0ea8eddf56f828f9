#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/choice/error_model.h"
#include "core/choice/families.h"
#include "core/choice/noise_spectrum.h"
#include "core/choice/odds_model.h"

namespace crease {

/// The finest bands of the spectrum, which tell whether the noise may be correlated at all.
inline constexpr std::size_t kTellingBands = 5;

/// Odds that a mesh whose spectrum looks like this comes out better when its noise counts as correlated.
using ScanOdds = OddsModel<2 * kTellingBands + 3>;

/// The growth of the lowest density from band to band, how much more there is elsewhere, band by band, the finest
/// density, all as logarithms, and the signs of how the mesh was captured.
ScanOdds::Numbers scan_numbers(const NoiseSpectrum& spectrum);

/// Of the spectrum, only the telling bands need be known.
bool may_be_correlated(const NoiseSpectrum& spectrum);

/// What a setting makes of a scan.
struct ScanLook {
  std::vector<float> angles;  ///< between faces, in radians
  double residual = 0;        ///< mean square of the way along the normals, in ℓ²
};

/// Of the logarithms of the mean normal errors of kScanSettings, and of the automatic setting for independent noise,
/// over that of the best of them; more than kWorst counts as kWorst. The features are the signs of how the mesh was
/// captured, the noise and its spectrum, quantiles of the dihedral angles as measured and after each of the telling
/// settings, and the residuals of these.
struct ScanModel : ErrorModel<11 + 3 * NoiseSpectrum{}.bands.size() + 7 * kTellingScanSettings.size(),
                              kScanSettings.size() + 1, Kernel::kGaussian> {
  static constexpr double kWorst = 2.5;
};
using ScanFeatures = ScanModel::Features;
using ScanErrors = ScanModel::Errors;

/// Whether the best of the settings for scans is expected to be better than that for independent noise, by enough:
/// meshes without noise lose much where their shape is taken for noise. What one camera sees needs less, since it is
/// hardly ever without, and what resembles no training pair needs more.
bool counts_as_scan(const ScanModel& model, const ScanFeatures& features);

/// `looks` of the telling settings.
ScanFeatures scan_features(std::span<const float> angles_measured, std::span<const ScanLook> looks,
                           const NoiseSpectrum& spectrum);

/// What the features say of the spectrum: its bands, but for the quarters, and how the mesh was captured.
NoiseSpectrum spectrum_of(const ScanFeatures& features);

/// Fitted on pairs with correlated noise, of depth cameras and other, with independent noise, and without
/// (tests/quality/fit_scans.cpp).
extern const ScanModel kFittedScanModel;
extern const ScanOdds kScanOdds;

}  // namespace crease
