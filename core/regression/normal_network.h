#pragma once

#include <array>

#include "core/regression/layers.h"
#include "core/regression/normal_features.h"

namespace crease {

/// Mixtures of the vectors of NormalFeatures; logarithms of the lengths of both, and the scalars, go through two layers
/// of rectified units to factors, which the mixtures and the vectors are summed with.
struct NormalNetwork {
  static constexpr std::size_t kMixtures = 36, kHidden = 64, kFactors = kMixtures + NormalFeatures::kVectors;
  static constexpr std::size_t kInputs = kFactors + NormalFeatures::kScalars;

  LayerWeights<kMixtures, NormalFeatures::kVectors> mixing;
  LayerWeights<kHidden, kInputs> first;
  std::array<float, kHidden> first_bias;
  LayerWeights<kHidden, kHidden> second;
  std::array<float, kHidden> second_bias;
  LayerWeights<kFactors, kHidden> third;
  std::array<float, kFactors> third_bias;
};

/// Of the passes (core/regression/passes.h), in order.
extern const NormalNetwork kFirstNormalNetwork, kSecondNormalNetwork;

}  // namespace crease
