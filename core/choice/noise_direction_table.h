#pragma once

#include "core/choice/noise_direction.h"

namespace crease {

// Written by fit_choice in tests/quality.
// clang-format off

inline constexpr DirectionOdds kFittedDirections{{{-0.42397, 0.44023, -1.9287, -0.94523, 0.11747, 0.35513, 2.4707, 4.9628, -0.099868}}, {{0.73888, 0.65263, 0.79966, 1.5289, 0.056963, 0.095188, 0.90428, 2.7657, 0.13663}}, {{3.4708, -0.71138, -0.84173, 0.79068, 1.7388, -0.66617, -0.005255, -0.38236, -1.3481, 0.84396, -0.047093, 0.27224, 0.08145, -0.41329, 0.15019, -0.14712, 0.13804, 0.28325, -2.2198}}};

// clang-format on

}  // namespace crease
