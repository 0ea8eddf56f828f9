// Denoises pairs by several methods, and prints tables in Markdown: crease_quality --help

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <map>

#include "core/base/heap.h"
#include "core/options/options.h"
#include "tests/quality/contenders.h"
#include "tests/quality/render.h"

namespace crease::quality {
namespace {

/// Errors below it count as this in geometric means, so that clean pairs have one.
constexpr double kLeastErrorDeg = 0.01;

struct Outcome {
  std::string pair, contender;
  Noise noise = Noise::kNormal;
  bool clean = false;
  std::size_t faces = 0;
  Scores scores;
};

std::string_view group_of(const Outcome& outcome) { return outcome.clean ? "clean" : word_of(outcome.noise); }

void print_details(const std::vector<Outcome>& outcomes) {
  fmt::print(
      "## Every pair\n\n| pair | faces | method | normal error (deg) | vertex error (edge lengths) | volume ratio | "
      "flipped faces | precision | recall | F1 | calibration error | seconds |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  for (const Outcome& o : outcomes) {
    const Measurement& m = o.scores.measured;
    fmt::print("| {} | {} | {} | {:.2f} | {:.4f} | {:.4f} | {} |", o.pair, o.faces, o.contender,
               m.mean_normal_error_deg, m.mean_vertex_error, 1 + m.volume_change, o.scores.flipped_faces);
    if (m.labels && o.scores.reliability) {
      fmt::print(" {:.3f} | {:.3f} | {:.3f} | {:.4f} |", m.labels->precision, m.labels->recall, m.labels->f1,
                 o.scores.reliability->calibration_error());
    } else {
      fmt::print(" | | | |");
    }
    fmt::print(" {:.3f} |\n", o.scores.seconds);
  }
}

void print_header(std::string_view title, std::string_view first, const std::vector<Contender>& contenders) {
  fmt::print("\n## {}\n\n| {} |", title, first);
  for (const Contender& contender : contenders) fmt::print(" {} |", contender.name);
  fmt::print("\n| --- |");
  for (std::size_t k = 0; k < contenders.size(); ++k) fmt::print(" --- |");
  fmt::print("\n");
}

void print_errors(const std::vector<Outcome>& outcomes, const std::vector<Contender>& contenders) {
  print_header("Normal error (deg)", "pair", contenders);
  for (std::size_t k = 0; k < outcomes.size(); ++k) {
    if (k % contenders.size() == 0) fmt::print("| {} |", outcomes[k].pair);
    fmt::print(" {:.2f} |", outcomes[k].scores.measured.mean_normal_error_deg);
    if (k % contenders.size() == contenders.size() - 1) fmt::print("\n");
  }
}

void print_means(const std::vector<Outcome>& outcomes, const std::vector<Contender>& contenders) {
  std::map<std::string_view, std::map<std::string, std::vector<double>>> errors;
  for (const Outcome& outcome : outcomes) {
    errors[group_of(outcome)][outcome.contender].push_back(outcome.scores.measured.mean_normal_error_deg);
  }
  print_header("Geometric mean of the normal error (deg)", "noise", contenders);
  for (const auto& [group, by_contender] : errors) {
    fmt::print("| {} ({}) |", group, by_contender.begin()->second.size());
    for (const Contender& c : contenders) {
      fmt::print(" {:.2f} |", geometric_mean(by_contender.at(c.name), kLeastErrorDeg));
    }
    fmt::print("\n");
  }
}

void print_reliability(const std::vector<Outcome>& outcomes, const std::vector<Contender>& contenders) {
  for (const Contender& contender : contenders) {
    Reliability pooled;
    bool labelled = false;
    for (const Outcome& outcome : outcomes) {
      if (outcome.contender != contender.name || !outcome.scores.reliability) continue;
      pooled.add(*outcome.scores.reliability);
      labelled = true;
    }
    if (!labelled) continue;
    fmt::print("\n## Reliability of the labels: {}\n\nExpected calibration error {:.4f}.\n\n", contender.name,
               pooled.calibration_error());
    fmt::print("| labels | mean label | share of ridges | edges |\n| --- | --- | --- | --- |\n");
    for (std::size_t k = 0; k < pooled.bins.size(); ++k) {
      const auto& bin = pooled.bins[k];
      fmt::print("| 0.{} to {:.1f} | {:.3f} | {:.3f} | {} |\n", k, static_cast<double>(k + 1) / 10, bin.mean_label(),
                 bin.ridge_share(), bin.count);
    }
  }
}

std::vector<Line> ridge_lines_of(const Mesh& mesh, const Topology& topology, const std::vector<double>& labels) {
  std::vector<Line> lines;
  for (std::size_t e = 0; e < labels.size(); ++e) {
    const auto [v0, v1] = topology.edges[e];
    if (is_ridge(labels[e])) lines.push_back({mesh.positions[v0], mesh.positions[v1], {0.85F, 0.1F, 0.1F}});
  }
  return lines;
}

/// 1 for edges over kReferenceRidgeDeg.
std::vector<double> sharp_edges_of(const Mesh& mesh, const Topology& topology) {
  std::vector<double> labels = signed_dihedral_angles(mesh, topology, mesh.positions);
  for (double& label : labels) label = std::abs(label) > kReferenceRidgeDeg * kDegree ? 1 : 0;
  return labels;
}

/// Draws original, noisy and result. The result of a method without labels shows its sharp edges.
void draw(const Pair& pair, const Topology& topology, const Denoised& denoised, const std::filesystem::path& png) {
  constexpr int kPixels = 600;
  const Mesh result{denoised.positions, pair.original.triangles};
  const auto labels = denoised.labels.empty() ? sharp_edges_of(result, topology) : denoised.labels;
  render_row({{pair.original, ridge_lines_of(pair.original, topology, sharp_edges_of(pair.original, topology))},
              {pair.noisy, {}},
              {result, ridge_lines_of(result, topology, labels)}},
             {-20, 35, pair.original.positions}, kPixels, png);
}

struct Request {
  PairSet set = PairSet::kShort;
  std::string only;
  std::vector<std::string> methods{"noisy", "default", "bilateral", "guided"};
  std::string meshes, pictures;
  std::uint32_t threads = 1;
};

void run(const Request& request) {
  std::vector<Contender> contenders;
  for (const std::string& name : request.methods) contenders.push_back(find_contender(name, request.threads));
  if (!request.pictures.empty()) std::filesystem::create_directories(request.pictures);
  std::vector<Outcome> outcomes;
  for (const PairRecipe& recipe : recipes_of(request.set)) {
    if (recipe.name().find(request.only) == std::string::npos) continue;
    const auto pair = build_pair(recipe, request.meshes);
    if (!pair) {
      fmt::print(stderr, "{}: not here, left out\n", recipe.name());
      continue;
    }
    const Topology topology = build_topology(pair->noisy);
    for (const Contender& contender : contenders) {
      const Denoised denoised = contender.denoise(*pair, topology);
      if (!request.pictures.empty()) {
        draw(*pair, topology, denoised,
             std::filesystem::path(request.pictures) / fmt::format("{}-{}.png", pair->name, contender.name));
      }
      outcomes.push_back({pair->name, contender.name, pair->noise, pair->level == 0 && pair->noise != Noise::kMeasured,
                          pair->original.triangles.size(), score(*pair, topology, denoised)});
      fmt::print(stderr, "{} {}: {:.2f} deg, {:.2f} s\n", pair->name, contender.name,
                 outcomes.back().scores.measured.mean_normal_error_deg, outcomes.back().scores.seconds);
    }
  }
  print_details(outcomes);
  print_errors(outcomes, contenders);
  print_means(outcomes, contenders);
  print_reliability(outcomes, contenders);
}

}  // namespace
}  // namespace crease::quality

int main(int argc, char** argv) {
  using namespace crease::quality;
  Request request;
  CLI::App app("Denoises pairs of noisy and original meshes, and prints tables in Markdown.");
  const std::map<std::string, PairSet> sets{
      {"development", PairSet::kDevelopment}, {"held-out", PairSet::kHeldOut}, {"short", PairSet::kShort}};
  app.add_option("--set", request.set, "development, held-out or short")->transform(CLI::Transformer(sets));
  app.add_option("--only", request.only, "pairs with this text in their name");
  app.add_option("--meshes", request.meshes, "folder of pairs with measured noise")->envname("CREASED_MESHES");
  app.add_option("--pictures", request.pictures, "folder for pictures of original, noisy and result");
  app.add_option("--threads", request.threads, "of core's methods");
  app.add_option("methods", request.methods, "see tests/quality/contenders.h");
  CLI11_PARSE(app, argc, argv);
  crease::reserve_heap(crease::half_of_memory());
  try {
    run(request);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
