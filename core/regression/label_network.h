#pragma once

#include <array>

#include "core/regression/label_features.h"
#include "core/regression/layers.h"

namespace crease {

/// Two layers of rectified units; the logistic function of what comes out is the label.
struct LabelNetwork {
  static constexpr std::size_t kHidden = 48;

  LayerWeights<kHidden, LabelFeatures::kCount> first;
  std::array<float, kHidden> first_bias;
  LayerWeights<kHidden, kHidden> second;
  std::array<float, kHidden> second_bias;
  LayerWeights<1, kHidden> third;
  std::array<float, 1> third_bias;
};

extern const LabelNetwork kLabelNetwork;

}  // namespace crease
