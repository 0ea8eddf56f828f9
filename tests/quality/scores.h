#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "core/measure/measure.h"
#include "tests/quality/pairs.h"

namespace crease::quality {

/// Labels against true ridges in ten bins of equal width.
struct Reliability {
  struct Bin {
    double label_sum = 0;
    std::size_t ridges = 0, count = 0;
    double mean_label() const { return count > 0 ? label_sum / static_cast<double>(count) : 0; }
    double ridge_share() const { return count > 0 ? static_cast<double>(ridges) / static_cast<double>(count) : 0; }
  };
  std::array<Bin, 10> bins{};

  void add(double label, bool is_ridge);
  void add(const Reliability& other);
  /// Expected calibration error: |mean label − share of ridges|, averaged over the edges [Naeini et al. 2015].
  double calibration_error() const;
};

/// What a method returns for a pair.
struct Denoised {
  std::vector<Vec3> positions;
  std::vector<double> labels;  ///< per edge of the topology; empty for a method without labels
  double seconds = 0;
};

struct Scores {
  Measurement measured;
  std::size_t flipped_faces = 0;  ///< turned by more than 90° from the original
  std::optional<Reliability> reliability;
  double seconds = 0;
};

/// Compares a result with the original. Ridges are interior edges with a dihedral angle over kReferenceRidgeDeg.
Scores score(const Pair& pair, const Topology& topology, const Denoised& result);

/// Of values of at least 0, each taken as at least `floor`; 0 for none.
double geometric_mean(std::span<const double> values, double floor);

}  // namespace crease::quality
