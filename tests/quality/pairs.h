#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/mesh/mesh.h"
#include "tests/quality/noise_models.h"

namespace crease::quality {

/// A noise-free mesh and a noisy one with the same faces.
struct Pair {
  std::string name;
  Noise noise = Noise::kNormal;
  double level = 0;  ///< in mean edge lengths
  Mesh original, noisy;
};

/// How a pair is made. Nothing is read or computed before `build_pair`.
struct PairRecipe {
  std::string model;
  std::string family;  ///< models of one family show the same object
  Noise noise = Noise::kNormal;
  double level = 0;
  std::uint64_t seed = 0;

  /// "fandisk-isotropic-0.5"; the model alone for measured noise.
  std::string name() const;
};

/// Methods are developed on the first set and judged by the second one; the third is a handful for a quick look. The
/// automatic choice is fitted to the last one, which shares no family of models with the held-out pairs.
enum class PairSet { kDevelopment, kHeldOut, kShort, kTraining };
std::vector<PairRecipe> recipes_of(PairSet set);

/// Kinds and levels of noise to fit the automatic choice to.
std::span<const std::pair<Noise, double>> training_noises();

/// Nothing where the model is not on this machine. `folder` has the pairs with measured noise, each as original.obj and
/// noisy.obj in a folder of its own.
std::optional<Pair> build_pair(const PairRecipe& recipe, const std::filesystem::path& folder);

}  // namespace crease::quality
