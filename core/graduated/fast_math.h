#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include "core/geometry/lanes.h"

namespace crease {

// Our own because those of the C library have other last bits from version to version, and because compilers put these
// into SIMD lanes without further switches.

/// log x for normal x > 0, to 2e-7 of max(1, |log x|).
CREASE_LANES_INLINE float fast_log(float x) {
  const auto bits = std::bit_cast<std::int32_t>(x);
  // x = 2^e · m with m in [√½, √2)
  const std::int32_t exponent = (bits - 0x3f3504f3) >> 23;
  const float m = std::bit_cast<float>(bits - exponent * (1 << 23));
  // log m = 2 artanh(s), s = (m − 1)/(m + 1), |s| < 0.172
  const float s = (m - 1) / (m + 1), t = s * s;
  const float artanh = s * (1 + t * (0.33333333F + t * (0.2F + t * (0.14285714F + t * 0.11111111F))));
  return static_cast<float>(exponent) * 0.69314718F + 2 * artanh;
}

/// The same in each lane.
CREASE_LANES_INLINE Lanes fast_log(const Lanes& x) {
  const auto bits = std::bit_cast<IntLanes>(x);
  const IntLanes exponent = (bits - 0x3f3504f3) >> 23;
  const auto m = std::bit_cast<Lanes>(bits - exponent * (1 << 23));
  const Lanes s = (m - 1) / (m + 1), t = s * s;
  const Lanes artanh = s * (1 + t * (0.33333333F + t * (0.2F + t * (0.14285714F + t * 0.11111111F))));
  return __builtin_convertvector(exponent, Lanes) * 0.69314718F + 2 * artanh;
}

/// exp x for |x| < 80, to a relative 3e-7.
CREASE_LANES_INLINE float fast_exp(float x) {
  const float scaled = x * 1.44269504F;
  const auto whole = static_cast<std::int32_t>(scaled + (scaled < 0 ? -0.5F : 0.5F));
  const float r = x - static_cast<float>(whole) * 0.69314718F;  // |r| ≤ 0.347
  const float series =
      1 + r * (1 + r * (0.5F + r * (0.16666667F + r * (0.041666667F + r * (0.0083333333F + r * 0.0013888889F)))));
  return series * std::bit_cast<float>((whole + 127) << 23);
}

/// The same in each lane.
CREASE_LANES_INLINE Lanes fast_exp(const Lanes& x) {
  const Lanes scaled = x * 1.44269504F;
  const auto whole = __builtin_convertvector(scaled + (scaled < 0 ? -0.5F + Lanes{} : 0.5F + Lanes{}), IntLanes);
  const Lanes r = x - __builtin_convertvector(whole, Lanes) * 0.69314718F;
  const Lanes series =
      1 + r * (1 + r * (0.5F + r * (0.16666667F + r * (0.041666667F + r * (0.0083333333F + r * 0.0013888889F)))));
  return series * std::bit_cast<Lanes>((whole + 127) << 23);
}

}  // namespace crease
