#pragma once

#include <stdexcept>
#include <string_view>

#include "core/graduated/potential.h"

namespace crease {

// What surfaces are made of, as potentials. The constants were set on the development pairs of tests/quality.

/// Flat faces that meet in sharp ridges.
inline constexpr PotentialFamily kCreaseFamily{
    .name = "creases", .exponent_end = 0, .scale = 0.01F, .local_gain = 2, .weight_power = 2, .ridge_cap = 0.01F};
/// Curved faces that meet in sharp ridges.
inline constexpr PotentialFamily kCurvedCreaseFamily{
    .name = "curved_creases", .exponent_end = 0.5F, .local_gain = 4, .weight_power = 2, .ridge_cap = 0.01F};
/// Flat faces that meet at any angle.
inline constexpr PotentialFamily kFlatFamily{.name = "flats"};
/// Between the two.
inline constexpr PotentialFamily kSoftCreaseFamily{
    .name = "soft_creases", .local_gain = 1, .weight_power = 2, .ridge_cap = 0.05F};
/// Curved all over.
inline constexpr PotentialFamily kOrganicFamily{
    .name = "organic", .exponent_end = 2, .exponent_start = 2, .local_gain = 1, .ridge_cap = 1};

/// The family with this name. \throw std::out_of_range
constexpr const PotentialFamily& family_named(std::string_view name) {
  for (const PotentialFamily* family :
       {&kCreaseFamily, &kCurvedCreaseFamily, &kFlatFamily, &kSoftCreaseFamily, &kOrganicFamily}) {
    if (family->name == name) return *family;
  }
  throw std::out_of_range("no family of potentials has this name");
}

}  // namespace crease
