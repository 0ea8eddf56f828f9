#pragma once

#include <bit>
#include <cstdint>

#include "core/geometry/lanes.h"

namespace crease {

// Our own because those of the C library have other last bits from version to version, and because compilers put these
// into SIMD lanes without further switches.

/// log x in each lane for normal x > 0, to 2e-7 of max(1, |log x|).
CREASE_LANES_INLINE Lanes fast_log(const Lanes& x) {
  constexpr std::int32_t kRootHalf = 0x3f3504f3, kExponentBits = -(1 << 23);
  const auto bits = std::bit_cast<IntLanes>(x);
  // x = 2^e · m with m in [√½, √2)
  const IntLanes above = bits - kRootHalf;
  const auto m = std::bit_cast<Lanes>(bits - (above & kExponentBits));
  // log m = 2 artanh(s), s = (m − 1)/(m + 1), |s| < 0.172; the series as short as single precision takes
  const Lanes s = (m - 1) / (m + 1), t = s * s;
  return __builtin_convertvector(above >> 23, Lanes) * 0.69314718F + s * (2 + t * (0.66653374F + t * 0.41290122F));
}

/// exp x in each lane for |x| < 80, to a relative 2e-7 (1 + |x|).
CREASE_LANES_INLINE Lanes fast_exp(const Lanes& x) {
  constexpr float kRounding = 12582912;  // 1.5 · 2^23: next to it numbers are whole, and their last bits count them
  const Lanes counted = x * 1.44269504F + kRounding;
  const Lanes r = x - (counted - kRounding) * 0.69314718F;  // |r| ≤ 0.347; the series as above
  const Lanes series = 1 + r * (1 + r * (0.4999923F + r * (0.16667115F + r * (0.04189033F + r * 0.0083125F))));
  return series * std::bit_cast<Lanes>((std::bit_cast<IntLanes>(counted) << 23) + 0x3f800000);
}

}  // namespace crease
