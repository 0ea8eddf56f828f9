#pragma once

#include <array>
#include <string_view>

#include "core/graduated/potential.h"

namespace crease {

// What surfaces are made of, as potentials; several may stand for the same kind of surface. The constants are the best
// of a random search on the training pairs of tests/quality.

/// Flat faces that meet in ridges.
inline constexpr PotentialFamily kCreaseFamily{.name = "creases",
                                               .exponent_end = 0,
                                               .scale = 0.01F,
                                               .local_gain = 2,
                                               .weight_power = 2,
                                               .ridge_cap = 0.01F,
                                               .ramp = 2};
/// The same, with edges that are either flat or ridges.
inline constexpr PotentialFamily kSharpCreaseFamily{.name = "creases",
                                                    .exponent_end = -1.2F,
                                                    .scale = 0.03F,
                                                    .local_gain = 2,
                                                    .weight_power = 2,
                                                    .ridge_cap = 0.004F,
                                                    .ramp = 4};
/// Curved faces that meet in ridges.
inline constexpr PotentialFamily kCurvedCreaseFamily{.name = "curved_creases",
                                                     .exponent_end = 0,
                                                     .scale = 0.02F,
                                                     .local_gain = 6,
                                                     .weight_power = 2,
                                                     .ridge_cap = 0.008F,
                                                     .ramp = 4};
/// The same, more strongly curved.
inline constexpr PotentialFamily kRoundCreaseFamily{.name = "curved_creases",
                                                    .exponent_end = -1.6F,
                                                    .scale = 0.035F,
                                                    .local_gain = 12,
                                                    .weight_power = 2,
                                                    .ridge_cap = 0.014F,
                                                    .ramp = 4};
/// Flat faces that meet at any angle.
inline constexpr PotentialFamily kFlatFamily{.name = "flats"};
/// Curved all over.
inline constexpr PotentialFamily kOrganicFamily{
    .name = "organic", .exponent_end = 2, .exponent_start = 2, .local_gain = 1, .ridge_cap = 1};
/// The same, without detail.
inline constexpr PotentialFamily kSmoothFamily{.name = "organic",
                                               .exponent_end = 2,
                                               .exponent_start = 2,
                                               .scale = 0.05F,
                                               .local_gain = 0.3F,
                                               .weight_power = 2,
                                               .ridge_cap = 0.3F,
                                               .ramp = 4};

/// A potential and the weight of the likelihood that goes with it, in units of one over the noise variance.
struct Setting {
  PotentialFamily family;
  double weight = 0.1;
};

/// Is solved before anything is known of the surface.
inline constexpr Setting kReference{kFlatFamily, 0.2};

/// What the automatic setting chooses among. Whoever changes them fits core/choice/expected_error_table.h anew.
inline constexpr std::array<Setting, 15> kSettings{{{kCreaseFamily, 0.05},
                                                    {kCreaseFamily, 0.1},
                                                    {kSharpCreaseFamily, 0.025},
                                                    {kCurvedCreaseFamily, 0.04},
                                                    {kRoundCreaseFamily, 0.005},
                                                    {kRoundCreaseFamily, 0.012},
                                                    {kFlatFamily, 0.1},
                                                    {kFlatFamily, 0.2},
                                                    {kSmoothFamily, 0.02},
                                                    {kSmoothFamily, 0.06},
                                                    {kOrganicFamily, 0.12},
                                                    {kOrganicFamily, 0.19},
                                                    {kOrganicFamily, 0.3},
                                                    {kOrganicFamily, 0.7},
                                                    {kOrganicFamily, 1.6}}};

}  // namespace crease
