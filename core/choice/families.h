#pragma once

#include <array>
#include <string_view>

#include "core/graduated/potential.h"

namespace crease {

// What surfaces are made of, as potentials; several may stand for the same kind of surface. The constants are the best
// of random searches on the training pairs of tests/quality.

/// Names of surfaces, as users say them.
namespace family {
inline constexpr std::string_view kCreases = "creases", kCurvedCreases = "curved_creases", kFlats = "flats",
                                  kOrganic = "organic";
}

/// Flat faces that meet in ridges.
inline constexpr PotentialFamily kCreaseFamily{.name = family::kCreases,
                                               .exponent_end = 0,
                                               .scale = 0.01F,
                                               .local_gain = 2,
                                               .weight_power = 2,
                                               .ridge_cap = 0.01F,
                                               .ramp = 2};
/// The same, with edges that are either flat or ridges.
inline constexpr PotentialFamily kSharpCreaseFamily{.name = family::kCreases,
                                                    .exponent_end = -1.2F,
                                                    .scale = 0.03F,
                                                    .local_gain = 2,
                                                    .weight_power = 2,
                                                    .ridge_cap = 0.004F,
                                                    .ramp = 4};
/// The same, smoothed once more in the end.
inline constexpr PotentialFamily kTwiceSmoothedCreaseFamily{.name = family::kCreases,
                                                            .exponent_end = -1.4F,
                                                            .scale = 0.0245F,
                                                            .local_gain = 2.1F,
                                                            .weight_power = 2,
                                                            .ridge_cap = 0.0081F,
                                                            .ramp = 2,
                                                            .diffuses_from = 5};
/// Creases that a coarse mesh has many of.
inline constexpr PotentialFamily kNarrowCreaseFamily{.name = family::kCreases,
                                                     .exponent_end = -1.4F,
                                                     .scale = 0.0102F,
                                                     .local_gain = 11.4F,
                                                     .ridge_cap = 0.0064F,
                                                     .ramp = 4};
/// Creases beside what is slightly curved.
inline constexpr PotentialFamily kMildCreaseFamily{.name = family::kCreases,
                                                   .exponent_end = -1.4F,
                                                   .scale = 0.0195F,
                                                   .local_gain = 3.96F,
                                                   .ridge_cap = 0.0409F,
                                                   .ramp = 4};
/// Curved faces that meet in ridges.
inline constexpr PotentialFamily kCurvedCreaseFamily{.name = family::kCurvedCreases,
                                                     .exponent_end = 0,
                                                     .scale = 0.02F,
                                                     .local_gain = 6,
                                                     .weight_power = 2,
                                                     .ridge_cap = 0.008F,
                                                     .ramp = 4};
/// The same, more strongly curved.
inline constexpr PotentialFamily kRoundCreaseFamily{.name = family::kCurvedCreases,
                                                    .exponent_end = -1.6F,
                                                    .scale = 0.035F,
                                                    .local_gain = 12,
                                                    .weight_power = 2,
                                                    .ridge_cap = 0.014F,
                                                    .ramp = 4};
/// The same, with wide ridges.
inline constexpr PotentialFamily kWideCreaseFamily{.name = family::kCurvedCreases,
                                                   .exponent_end = -0.8F,
                                                   .scale = 0.0116F,
                                                   .local_gain = 6.5F,
                                                   .ridge_cap = 0.0547F,
                                                   .ramp = 4};
/// The same, smoothed again and again once ridges have begun to show.
inline constexpr PotentialFamily kDiffusedCreaseFamily{.name = family::kCurvedCreases,
                                                       .exponent_end = -1.4F,
                                                       .scale = 0.0315F,
                                                       .local_gain = 8,
                                                       .ridge_cap = 0.0056F,
                                                       .ramp = 4,
                                                       .diffuses_from = 3};
/// Curved all over: nearly a linear filter, for what is to be learnt of the noise.
inline constexpr PotentialFamily kOrganicFamily{
    .name = family::kOrganic, .exponent_end = 2, .exponent_start = 2, .local_gain = 1, .ridge_cap = 1};
/// Flat faces that meet at any angle.
inline constexpr PotentialFamily kFlatFamily{.name = family::kFlats};
/// The same, with a scale far below any facet.
inline constexpr PotentialFamily kFineFlatFamily{.name = family::kFlats, .scale = 0.003F};
/// Curved all over, without detail.
inline constexpr PotentialFamily kSmoothFamily{.name = family::kOrganic,
                                               .exponent_end = 2,
                                               .exponent_start = 2,
                                               .scale = 0.05F,
                                               .local_gain = 0.3F,
                                               .weight_power = 2,
                                               .ridge_cap = 0.3F,
                                               .ramp = 4};
/// The same, as a diffusion.
inline constexpr PotentialFamily kBroadFamily{.name = family::kOrganic,
                                              .exponent_end = 1.5F,
                                              .exponent_start = 1.5F,
                                              .scale = 0.1127F,
                                              .local_gain = 1.654F,
                                              .ridge_cap = 0.053F,
                                              .diffuses_from = 1};
/// With some detail.
inline constexpr PotentialFamily kRollingFamily{.name = family::kOrganic,
                                                .exponent_end = 2,
                                                .exponent_start = 2,
                                                .scale = 0.0454F,
                                                .local_gain = 2.63F,
                                                .weight_power = 2,
                                                .ridge_cap = 0.064F,
                                                .diffuses_from = 1};
/// With folds.
inline constexpr PotentialFamily kFoldedFamily{.name = family::kOrganic,
                                               .exponent_end = 1,
                                               .exponent_start = 1,
                                               .scale = 0.0566F,
                                               .local_gain = 0.943F,
                                               .weight_power = 2,
                                               .ridge_cap = 0.066F,
                                               .ramp = 4,
                                               .diffuses_from = 1};
/// With detail as fine as the mesh.
inline constexpr PotentialFamily kDetailedFamily{.name = family::kOrganic,
                                                 .exponent_end = 1.5F,
                                                 .exponent_start = 1.5F,
                                                 .scale = 0.0828F,
                                                 .local_gain = 0.378F,
                                                 .weight_power = 2,
                                                 .ridge_cap = 0.042F,
                                                 .ramp = 4,
                                                 .diffuses_from = 1};

/// For scans: curved all over, with soft creases.
inline constexpr PotentialFamily kSoftCreaseFamily{.name = family::kOrganic,
                                                   .exponent_end = 0,
                                                   .exponent_start = 1.5F,
                                                   .scale = 0.068F,
                                                   .local_gain = 4.7F,
                                                   .weight_power = 2,
                                                   .ridge_cap = 0.285F,
                                                   .ramp = 4};
/// For scans: flat faces that meet in ridges, with a scale far below any facet.
inline constexpr PotentialFamily kFineCreaseFamily{.name = family::kCreases,
                                                   .exponent_end = -0.34F,
                                                   .scale = 0.0053F,
                                                   .local_gain = 1,
                                                   .weight_power = 2,
                                                   .ridge_cap = 0.0276F,
                                                   .ramp = 4};

/// A potential and the weight of the likelihood that goes with it, in units of one over the noise variance.
struct Setting {
  PotentialFamily family;
  double weight = 0.1;
};

/// Is solved before anything is known of the surface.
inline constexpr Setting kReference{kFlatFamily, 0.2};

/// What the automatic setting chooses among. Whoever changes them fits the tables of core/choice/expected_error
/// and second_look anew.
inline constexpr std::array<Setting, 22> kSettings{{{kCreaseFamily, 0.05},
                                                    {kCreaseFamily, 0.1},
                                                    {kSharpCreaseFamily, 0.025},
                                                    {kNarrowCreaseFamily, 0.0101},
                                                    {kTwiceSmoothedCreaseFamily, 0.0101},
                                                    {kMildCreaseFamily, 0.1627},
                                                    {kCurvedCreaseFamily, 0.04},
                                                    {kRoundCreaseFamily, 0.005},
                                                    {kRoundCreaseFamily, 0.012},
                                                    {kDiffusedCreaseFamily, 0.1365},
                                                    {kWideCreaseFamily, 0.0251},
                                                    {kFlatFamily, 0.1},
                                                    {kFlatFamily, 0.2},
                                                    {kDetailedFamily, 1.4},
                                                    {kBroadFamily, 0.33},
                                                    {kRollingFamily, 0.39},
                                                    {kFoldedFamily, 0.427},
                                                    {kSmoothFamily, 0.02},
                                                    {kSmoothFamily, 0.06},
                                                    {kOrganicFamily, 0.12},
                                                    {kOrganicFamily, 0.19},
                                                    {kOrganicFamily, 0.3}}};

/// For scans, whose noise is correlated: what is chosen among. The weights are in 1/ℓ², as hardly anything but the size
/// of the surface's detail tells how much of the noise's waves can be told from it. Whoever changes these or the next
/// fits the table of core/choice/scan_error anew.
inline constexpr std::array<Setting, 28> kScanSettings{
    {{kFineFlatFamily, 2},         {kFineFlatFamily, 0.5},     {kFineFlatFamily, 0.12},     {kFlatFamily, 0.77},
     {kMildCreaseFamily, 0.31},    {kMildCreaseFamily, 0.049}, {kFineCreaseFamily, 1},      {kFineCreaseFamily, 0.31},
     {kFineCreaseFamily, 0.1},     {kCurvedCreaseFamily, 1.9}, {kCurvedCreaseFamily, 0.31}, {kCurvedCreaseFamily, 0.12},
     {kCurvedCreaseFamily, 0.049}, {kRoundCreaseFamily, 1.9},  {kRoundCreaseFamily, 0.31},  {kRoundCreaseFamily, 0.12},
     {kRoundCreaseFamily, 0.049},  {kWideCreaseFamily, 1.9},   {kWideCreaseFamily, 0.77},   {kSoftCreaseFamily, 4},
     {kSoftCreaseFamily, 1.3},     {kSoftCreaseFamily, 0.44},  {kSoftCreaseFamily, 0.15},   {kFoldedFamily, 0.31},
     {kSmoothFamily, 4.8},         {kSmoothFamily, 0.77},      {kOrganicFamily, 12},        {kOrganicFamily, 1.9}}};

/// Those that are solved first; what they make of a scan tells which is best.
inline constexpr std::array<Setting, 3> kTellingScanSettings{
    {{kFlatFamily, 1.9}, {kFlatFamily, 0.049}, {kRoundCreaseFamily, 0.12}}};

}  // namespace crease
