#pragma once

#include <array>
#include <istream>
#include <string>
#include <vector>

#include "core/choice/second_look.h"
#include "tests/quality/error_fit.h"

namespace crease::quality {

/// A training pair, and what every setting makes of it.
struct SettingSample : Sample<SettingModel> {
  std::array<Look, kSettings.size()> looks{};
  /// Between the normals of the reference and of all settings, as in second_features: of each result to all later ones.
  std::array<double, kSettings.size() * (kSettings.size() + 1) / 2> angles{};

  void read(std::istream& words);
  /// Result 0 is the reference, result i + 1 that of setting i.
  double angle_deg(std::size_t result, std::size_t other) const;
};

/// Prints core/choice/second_look_table.h, and what the choice costs to stderr.
void write_second_table(const std::vector<std::string>& files);

}  // namespace crease::quality
