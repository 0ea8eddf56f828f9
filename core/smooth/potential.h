#pragma once

#include <cmath>

#include "core/options/options.h"
#include "core/smooth/lanes.h"

namespace crease {

/// ρ(x) by ‖x‖² (§3.2), for x a difference of unit normals. `width` is where Huber's and the truncated potential leave
/// the quadratic one, as a length of x. Number: double, or lanes.
template <Smoothness kShape, typename Number>
CREASE_LANES_INLINE Number smoothness_potential(const Number& square, float width) {
  using crease::sqrt;
  using std::sqrt;
  if constexpr (kShape == Smoothness::kQuadratic) {
    return square;
  } else if constexpr (kShape == Smoothness::kSquareRoot) {
    return sqrt(square);
  } else if constexpr (kShape == Smoothness::kHuber) {
    return square < width * width ? square : 2 * width * sqrt(square) - width * width;
  } else {
    return square < width * width ? square : width * width + Number{};
  }
}

/// Calls `body` with the shape as a constant.
template <typename Body>
CREASE_LANES_INLINE auto with_shape(Smoothness shape, Body body) {
  switch (shape) {
    case Smoothness::kQuadratic:
      return body.template operator()<Smoothness::kQuadratic>();
    case Smoothness::kSquareRoot:
      return body.template operator()<Smoothness::kSquareRoot>();
    case Smoothness::kHuber:
      return body.template operator()<Smoothness::kHuber>();
    default:
      return body.template operator()<Smoothness::kTruncated>();
  }
}

inline double smoothness_potential(Smoothness shape, double square, float width) {
  return with_shape(shape, [&]<Smoothness kShape>() { return smoothness_potential<kShape>(square, width); });
}

/// dρ/d‖x‖² at a square above 0: the weight of the quadratic function that touches ρ there.
inline float smoothness_slope(Smoothness shape, float square, float width) {
  switch (shape) {
    case Smoothness::kSquareRoot:
      return 0.5F / std::sqrt(square);
    case Smoothness::kHuber:
      return square < width * width ? 1.0F : width / std::sqrt(square);
    case Smoothness::kTruncated:
      return square < width * width ? 1.0F : 0.0F;
    default:
      return 1.0F;
  }
}

}  // namespace crease
