#pragma once

#include <array>
#include <cstddef>

#include "core/geometry/lanes.h"

namespace crease {

// Layers of small networks, on eight items at once, one in each lane. Our own: they run inside loops over faces and
// edges, and have to come out the same on every machine.

template <std::size_t outputs, std::size_t inputs>
using LayerWeights = std::array<std::array<float, inputs>, outputs>;

/// Outputs `first` to `first + count` of `apply`.
template <std::size_t count, std::size_t outputs, std::size_t inputs>
CREASE_LANES_INLINE void apply_some(const LayerWeights<outputs, inputs>& weights,
                                    const std::array<float, outputs>& bias, const LaneArray<inputs>& in,
                                    LaneArray<outputs>& out, std::size_t first) {
  LaneArray<count> sums{};
  for (std::size_t i = 0; i < inputs; ++i) {
    for (std::size_t k = 0; k < count; ++k) sums[k] += weights[first + k][i] * in[i];
  }
  for (std::size_t k = 0; k < count; ++k) out[first + k] = sums[k] + bias[first + k];
}

/// out_o = bias_o + Σ_i weights[o][i] in_i
template <std::size_t outputs, std::size_t inputs>
CREASE_LANES_INLINE void apply(const LayerWeights<outputs, inputs>& weights, const std::array<float, outputs>& bias,
                               const LaneArray<inputs>& in, LaneArray<outputs>& out) {
  constexpr std::size_t kAtATime = 8, kRest = outputs % kAtATime;
  for (std::size_t o = 0; o + kAtATime <= outputs; o += kAtATime) apply_some<kAtATime>(weights, bias, in, out, o);
  if constexpr (kRest > 0) apply_some<kRest>(weights, bias, in, out, outputs - kRest);
}

template <std::size_t count>
CREASE_LANES_INLINE void rectify(LaneArray<count>& values) {
  for (Lanes& value : values.items) value = value > 0 ? value : Lanes{};
}

}  // namespace crease
