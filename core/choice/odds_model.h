#pragma once

#include <array>
#include <cstddef>

#include "core/choice/error_model.h"

namespace crease {

/// Logistic regression on some numbers, standardised, and their squares.
template <std::size_t kCount>
struct OddsModel {
  static constexpr std::size_t kNumbers = kCount;
  using Numbers = std::array<double, kNumbers>;
  using Terms = std::array<double, 2 * kNumbers + 1>;

  Numbers means{}, deviations{};
  Terms factors{};  ///< of the numbers, of their squares, of 1

  /// What the factors are for.
  Terms terms_of(const Numbers& numbers) const {
    Terms terms{};
    for (std::size_t k = 0; k < kNumbers; ++k) {
      terms[k] = standardised(numbers[k], means[k], deviations[k]);
      terms[kNumbers + k] = terms[k] * terms[k];
    }
    terms.back() = 1;
    return terms;
  }

  /// Logarithm of the odds.
  double log_odds(const Numbers& numbers) const {
    const Terms terms = terms_of(numbers);
    double sum = 0;
    for (std::size_t k = 0; k < terms.size(); ++k) sum += factors[k] * terms[k];
    return sum;
  }
};

}  // namespace crease
