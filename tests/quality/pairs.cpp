#include "tests/quality/pairs.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <stdexcept>
#include <tuple>

#include "core/io/decode.h"
#include "tests/quality/depth_camera.h"
#include "tests/quality/fused_scan.h"
#include "tests/quality/parts.h"
#include "tests/support/meshes.h"

namespace crease::quality {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kDevelopmentSeed = 1, kHeldOutSeed = 2, kTrainingSeed = 3;

/// A model that is made here.
struct MadeModel {
  std::string name;
  std::function<Mesh()> make;
};

const std::vector<MadeModel>& made_models() {
  static const std::vector<MadeModel> models{
      {"cut_box", [] { return cut_box(kRegular).mesh; }},
      {"cut_box_irregular", [] { return cut_box(kIrregular).mesh; }},
      {"cut_box_graded", [] { return cut_box(kGraded).mesh; }},
      {"cut_box_slivers", [] { return cut_box(kSlivers).mesh; }},
      {"cut_box_open", [] { return cut_box(kOpen).mesh; }},
      {"bracket", [] { return bracket(kRegular).mesh; }},
      {"bracket_irregular", [] { return bracket(kIrregular).mesh; }},
      {"shaft", [] { return shaft(kRegular).mesh; }},
      {"shaft_graded", [] { return shaft(kGraded).mesh; }},
      {"shaft_slivers", [] { return shaft(kSlivers).mesh; }},
      {"cone", [] { return cone(kRegular).mesh; }},
      {"elbow", [] { return elbow(kRegular).mesh; }},
      {"facets_16", [] { return prism(16, 1, 12).mesh; }},
      {"wide_facets_16", [] { return prism(16, 4, 40).mesh; }},
      {"channel", [] { return channel(kRegular).mesh; }},
      {"channel_irregular", [] { return channel(kIrregular).mesh; }},
      {"channel_slivers", [] { return channel(kSlivers).mesh; }},
      {"spindle", [] { return spindle(kRegular).mesh; }},
      {"spindle_graded", [] { return spindle(kGraded).mesh; }},
      {"bullet", [] { return bullet(kRegular).mesh; }},
      {"bullet_open", [] { return bullet(kOpen).mesh; }},
      {"stepped_block", [] { return test::cad_part(6).mesh; }},
      {"facets_18", [] { return prism(18, 1, 14).mesh; }},
  };
  return models;
}

struct Row {
  std::string model, family;
  std::vector<std::pair<Noise, double>> noises;
};

std::vector<PairRecipe> spell_out(const std::vector<Row>& rows, std::uint64_t seed) {
  std::vector<PairRecipe> recipes;
  for (const Row& row : rows) {
    for (const auto& [noise, level] : row.noises) recipes.push_back({row.model, row.family, noise, level, seed});
  }
  return recipes;
}

using enum Noise;

/// The first eight pairs are those of the table of goals.
std::vector<PairRecipe> development_recipes() {
  return spell_out(
      {{"Fandisk0.3", "fandisk", {{kMeasured, 0.3}}},
       {"Twelve0.5Impulsive", "twelve", {{kMeasured, 0.35}}},
       {"Bunny0.2", "bunny", {{kMeasured, 0.2}}},
       {"KinectPyramid", "pyramid", {{kMeasured, 0}}},
       {"fandisk", "fandisk", {{kIsotropic, 0.5}}},
       {"anchor_dense", "anchor", {{kNormal, 0.3}}},
       {"rotor", "rotor", {{kNormal, 0.2}}},
       {"elephant", "elephant", {{kNormal, 0.3}}},
       {"fandisk",
        "fandisk",
        {{kNormal, 0},
         {kNormal, 0.02},
         {kNormal, 0.1},
         {kNormal, 0.7},
         {kImpulsive, 0.5},
         {kSparse, 0.5},
         {kGrowing, 0.2},
         {kCorrelated, 0.2},
         {kDepth, 0.5},
         {kFused, 1}}},
       {"anchor_dense", "anchor", {{kIsotropic, 0.3}, {kGrowing, 0.3}}},
       {"rotor_small", "rotor", {{kNormal, 0}, {kNormal, 0.2}, {kNormal, 0.3}}},
       {"elephant",
        "elephant",
        {{kNormal, 0}, {kImpulsive, 0.3}, {kSparse, 0.5}, {kDepth, 0}, {kDepth, 0.5}, {kFused, 1}}},
       {"knot1", "knot", {{kNormal, 0}, {kNormal, 0.2}, {kGrowing, 0.2}, {kDepth, 0.3}}},
       {"armadillo", "armadillo", {{kNormal, 0}, {kNormal, 0.2}, {kCorrelated, 0.3}}},
       {"cylinder_locally_refined", "cylinder", {{kNormal, 0.2}}},
       {"blade", "blade", {{kNormal, 0.2}}},
       {"lion-head", "lion", {{kIsotropic, 0.2}, {kDepth, 0.7}}},
       {"cow", "cow", {{kNormal, 0.1}}},
       {"cut_box", "cut_box", {{kNormal, 0}, {kNormal, 0.2}, {kIsotropic, 0.3}, {kGrowing, 0.3}, {kCorrelated, 0.3}}},
       {"cut_box_irregular", "cut_box", {{kNormal, 0.3}}},
       {"cut_box_graded", "cut_box", {{kNormal, 0}, {kNormal, 0.2}}},
       {"cut_box_slivers", "cut_box", {{kNormal, 0.1}, {kNormal, 0.3}}},
       {"cut_box_open", "cut_box", {{kNormal, 0.3}}},
       {"bracket", "bracket", {{kNormal, 0.2}, {kImpulsive, 0.5}, {kDepth, 0}, {kDepth, 0.5}}},
       {"bracket_irregular", "bracket", {{kIsotropic, 0.3}, {kGrowing, 0.3}}},
       {"shaft", "shaft", {{kNormal, 0.3}}},
       {"shaft_graded", "shaft", {{kNormal, 0.2}}},
       {"shaft_slivers", "shaft", {{kNormal, 0.2}}},
       {"cone", "cone", {{kNormal, 0.2}, {kDepth, 0.5}, {kFused, 0.5}}},
       {"elbow", "elbow", {{kNormal, 0}, {kNormal, 0.2}, {kNormal, 0.5}}},
       {"facets_16", "facets_16", {{kNormal, 0}, {kNormal, 0.1}}},
       {"wide_facets_16", "facets_16", {{kNormal, 0.2}}}},
      kDevelopmentSeed);
}

std::vector<PairRecipe> held_out_recipes() {
  return spell_out(
      {{"turbine", "turbine", {{kNormal, 0.2}, {kIsotropic, 0.3}}},
       {"couplingdown", "coupling", {{kNormal, 0.2}}},
       {"spool", "spool", {{kNormal, 0.1}}},
       {"mech-holes-shark", "shark", {{kNormal, 0.3}, {kCorrelated, 0.2}, {kDepth, 0.5}}},
       {"handle", "handle", {{kNormal, 0.2}}},
       {"cheese", "cheese", {{kNormal, 0.3}}},
       {"camel", "camel", {{kNormal, 0}, {kNormal, 0.2}, {kGrowing, 0.2}, {kDepth, 0}, {kDepth, 0.3}, {kFused, 0.5}}},
       {"triceratops", "triceratops", {{kIsotropic, 0.2}, {kDepth, 0.5}}},
       {"homer", "homer", {{kNormal, 0.3}, {kImpulsive, 0.3}, {kSparse, 0.5}, {kDepth, 0.5}, {kFused, 1}}},
       {"femur", "femur", {{kNormal, 0.1}, {kDepth, 0.7}}},
       {"ChineseDragon-10kv", "dragon", {{kNormal, 0}, {kNormal, 0.2}}},
       {"diplodocus", "diplodocus", {{kCorrelated, 0.3}}},
       {"retinal", "retinal", {{kNormal, 0.5}}},
       {"channel", "channel", {{kNormal, 0}, {kNormal, 0.2}, {kIsotropic, 0.5}, {kCorrelated, 0.3}, {kDepth, 0.5}}},
       {"channel_irregular", "channel", {{kGrowing, 0.3}, {kSparse, 0.3}}},
       {"channel_slivers", "channel", {{kNormal, 0.2}}},
       {"spindle", "spindle", {{kNormal, 0.3}}},
       {"spindle_graded", "spindle", {{kNormal, 0.2}}},
       {"bullet", "bullet", {{kNormal, 0}, {kNormal, 0.2}, {kDepth, 0}, {kDepth, 0.5}, {kFused, 1}}},
       {"bullet_open", "bullet", {{kIsotropic, 0.2}}},
       {"stepped_block", "stepped_block", {{kNormal, 0}, {kNormal, 0.3}, {kImpulsive, 0.5}, {kFused, 1}}},
       {"facets_18", "facets_18", {{kNormal, 0.1}}}},
      kHeldOutSeed);
}

/// Twelve kinds and levels of noise on every model, another twelve on the next one.
std::vector<PairRecipe> training_recipes() {
  constexpr std::size_t kPairsOfModel = 12;
  const std::vector<std::pair<std::string, std::vector<std::string>>> families{
      {"anchor", {"anchor", "anchor_dense"}},
      {"bear", {"bear", "bear_bis"}},
      {"blob", {"blob", "blobby", "blobby_3cc"}},
      {"bracket", {"bracket", "bracket_irregular"}},
      {"bunny", {"bunny00"}},
      {"cross", {"cross"}},
      {"cut_box", {"cut_box", "cut_box_irregular", "cut_box_graded", "cut_box_slivers", "cut_box_open"}},
      {"elephant", {"elephant", "refined_elephant", "elephant-with-holes"}},
      {"facets_16", {"facets_16", "wide_facets_16"}},
      {"fandisk", {"fandisk", "fandisk_large"}},
      {"horizons", {"horizons", "horizons-domain"}},
      {"knot", {"knot", "knot1", "knot2"}},
      {"mannequin", {"mannequin-devil", "mpi"}},
      {"patch", {"patch-01", "patch-13", "patch-20", "patch-21", "patch-23", "patch-30"}},
      {"pinion", {"pinion", "pinion_small"}},
      {"rotor", {"rotor", "rotor_small"}},
      {"shaft", {"shaft", "shaft_graded", "shaft_slivers"}},
      {"sphere", {"sphere", "sphere966", "geosphere", "larger_sphere", "ellipsoid"}},
      {"torus", {"3torus", "torus_quad", "double-torus-example"}}};
  const std::vector<std::string> others{"ALSTOM_TEST4",
                                        "P",
                                        "b9_mesh",
                                        "beam",
                                        "blade",
                                        "boeing",
                                        "bones",
                                        "bull",
                                        "cactus",
                                        "cone",
                                        "cow",
                                        "cube-meshed",
                                        "cylinder",
                                        "cylinder_locally_refined",
                                        "dino",
                                        "dragknob",
                                        "eight",
                                        "elbow",
                                        "elk",
                                        "ellipe0.003",
                                        "hand",
                                        "head",
                                        "helmet",
                                        "holes",
                                        "in",
                                        "itemb",
                                        "joint",
                                        "lion",
                                        "lion-head",
                                        "man",
                                        "mask_cone",
                                        "mesh_with_border",
                                        "mushroom",
                                        "nefertiti",
                                        "oblong",
                                        "part",
                                        "pig",
                                        "pipe",
                                        "prim",
                                        "star",
                                        "three_peaks",
                                        "tripod",
                                        "u"};
  const std::span noises = training_noises();
  std::vector<Row> rows;
  const auto add = [&](const std::string& model, const std::string& family) {
    Row& row = rows.emplace_back(Row{model, family, {}});
    for (std::size_t k = 0; k < kPairsOfModel; ++k)
      row.noises.push_back(noises[(rows.size() * 7 + 3 * k) % noises.size()]);
  };
  for (const auto& [family, models] : families) {
    for (const std::string& model : models) add(model, family);
  }
  for (const std::string& model : others) add(model, model);
  return spell_out(rows, kTrainingSeed);
}

std::vector<PairRecipe> short_recipes() {
  return spell_out({{"cut_box", "cut_box", {{kNormal, 0}, {kNormal, 0.3}}},
                    {"bracket_irregular", "bracket", {{kIsotropic, 0.3}, {kGrowing, 0.3}}},
                    {"shaft", "shaft", {{kImpulsive, 0.5}}},
                    {"facets_16", "facets_16", {{kNormal, 0.1}}}},
                   kDevelopmentSeed);
}

std::optional<Mesh> load_mesh(const fs::path& path) {
  if (!fs::exists(path)) return std::nullopt;
  return decode_mesh(test::read_file(path), format_from_filename(path.string())).mesh;
}

std::optional<Mesh> original_of(const std::string& model) {
  const auto made = std::ranges::find(made_models(), model, &MadeModel::name);
  if (made != made_models().end()) return made->make();
  const auto path = test::cgal_mesh(model + ".off");
  return path ? load_mesh(*path) : std::nullopt;
}

/// What cameras like those of [Wang et al. 2016] see, one or several: their noise is smooth over a pixel, a third of it
/// over three, and rounded. The level is in pixels.
std::pair<Mesh, Mesh> seen(const Mesh& model, const PairRecipe& recipe) {
  const DepthNoise noise{.level = recipe.level,
                         .fine_width = 1,
                         .broad_width = 3,
                         .broad_share = 0.35,
                         .growth_with_slope = 0,
                         .step = recipe.level / 2,
                         .rounds_disparity = false};
  const DepthCamera camera{.pixels_across = 110, .distance = 4, .farthest_step = 6};
  const FusedScan scan{.voxels_across = 50, .views = 6, .pixels_across = 60, .misplacement = 0.2, .noise = noise};
  auto view = recipe.noise == Noise::kFused ? take_fused_scan(model, scan, recipe.seed)
                                            : take_depth_view(model, camera, noise, recipe.seed);
  if (!view) throw std::runtime_error("the camera sees nothing of " + recipe.model);
  return {std::move(view->original), std::move(view->noisy)};
}

}  // namespace

std::span<const std::pair<Noise, double>> training_noises() {
  static const std::vector<std::pair<Noise, double>> noises{
      {kNormal, 0.05},   {kNormal, 0.1},    {kNormal, 0.15},   {kNormal, 0.2},    {kNormal, 0.25},   {kNormal, 0.3},
      {kNormal, 0.4},    {kNormal, 0.6},    {kIsotropic, 0.1}, {kIsotropic, 0.2}, {kIsotropic, 0.3}, {kIsotropic, 0.5},
      {kImpulsive, 0.3}, {kImpulsive, 0.5}, {kGrowing, 0.15},  {kGrowing, 0.3},   {kNormal, 0.35}};
  return noises;
}

std::string PairRecipe::name() const {
  return noise == Noise::kMeasured ? model : fmt::format("{}-{}-{}", model, word_of(noise), level);
}

std::vector<PairRecipe> recipes_of(PairSet set) {
  switch (set) {
    case PairSet::kDevelopment:
      return development_recipes();
    case PairSet::kHeldOut:
      return held_out_recipes();
    case PairSet::kShort:
      return short_recipes();
    case PairSet::kTraining:
      return training_recipes();
  }
  throw std::invalid_argument("no such set of pairs");
}

std::optional<Pair> build_pair(const PairRecipe& recipe, const fs::path& folder) {
  Pair pair{recipe.name(), recipe.noise, recipe.level, {}, {}};
  const bool measured = recipe.noise == Noise::kMeasured;
  if (measured && folder.empty()) return std::nullopt;
  auto original = measured ? load_mesh(folder / recipe.model / "original.obj") : original_of(recipe.model);
  auto noisy = measured ? load_mesh(folder / recipe.model / "noisy.obj") : std::nullopt;
  if (!original || (measured && !noisy)) return std::nullopt;
  if (recipe.noise == Noise::kDepth || recipe.noise == Noise::kFused) {
    std::tie(pair.original, pair.noisy) = seen(*original, recipe);
    return pair;
  }
  pair.noisy = measured ? *std::move(noisy) : add_noise_of_kind(*original, recipe.noise, recipe.level, recipe.seed);
  pair.original = *std::move(original);
  return pair;
}

}  // namespace crease::quality
