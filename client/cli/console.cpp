#include "client/cli/console.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

namespace crease::client {

void Console::result(const nlohmann::ordered_json& object, const std::string& text) const {
  if (json) {
    fmt::print("{}\n", object.dump());
  } else if (!quiet) {
    fmt::print("{}\n", text);
  }
}

void add_console_options(CLI::App& command, Console& console) {
  command.add_flag("--json", console.json,
                   "Print the result as one JSON object; after an error, print a problem document");
  command.add_flag("-q,--quiet", console.quiet, "Print no progress and no figures");
}

std::string job_line(const v1::Job& job) {
  return fmt::format("{}  {:<9}  {:3.0f} %  {}  {} faces", job.id(), job.state(), 100 * job.progress().fraction(),
                     job.input().name(), job.input().faces());
}

std::string noise_text(const v1::Choice& choice) {
  constexpr double kNoNoise = 1e-3;  // edge lengths
  if (choice.noise_sigma() < kNoNoise) return "no noise";
  std::string text = fmt::format("noise {:.2g} edge lengths", choice.noise_sigma());
  if (choice.correlation_length() > 0) {
    return text + fmt::format(", correlated over {:.1f} edges", choice.correlation_length());
  }
  if (choice.noise() == "normal") text += " along the normals";
  if (choice.noise() == "isotropic") text += " in all directions";
  if (choice.impulsive()) text += fmt::format(", at {:.0f} % of the vertices", 100 * choice.moved_share());
  if (choice.varying()) text += ", varying over the surface";
  return text;
}

/// "noise 0.31 edge lengths along the normals; creases by far".
std::string sentence(const v1::Choice& choice) {
  constexpr double kClearMargin = 0.15;
  std::string text = noise_text(choice);
  if (choice.spikes() > 0)
    text += fmt::format(", {} {} flattened", choice.spikes(), choice.spikes() == 1 ? "spike" : "spikes");
  text += fmt::format("; {} {}", choice.surface(), choice.margin() > kClearMargin ? "by far" : "by a narrow margin");
  std::ranges::replace(text, '_', ' ');
  return text;
}

std::string figures(const v1::Job& job) {
  const v1::InputFacts& input = job.input();
  const v1::ResultFacts& result = job.result();
  std::string text = fmt::format("job            {}\n", job.id());
  text += fmt::format("input          {} vertices, {} faces, noise about {:.2g} edge lengths\n", input.vertices(),
                      input.faces(), input.noise_sigma());
  if (result.has_choice()) text += fmt::format("estimate       {}\n", sentence(result.choice()));
  for (const v1::Choice& other : result.other_choices()) {
    text += fmt::format("               apart, {} faces: {}\n", other.faces(), sentence(other));
  }
  text += fmt::format("ridges         {} edges in {} lines, length {:.5g}\n", result.ridge_edges(),
                      result.ridge_lines(), result.ridge_length());
  text += fmt::format("displacement   rms {:.3g}, max {:.3g} edge lengths\n", result.rms_displacement(),
                      result.max_displacement());
  if (result.has_uncertainty()) {
    const v1::Uncertainty& sigma = result.uncertainty();
    text += fmt::format("uncertainty    mean {:.2g}, median {:.2g}, max {:.2g} edge lengths\n", sigma.mean(),
                        sigma.median(), sigma.max());
  }
  text += fmt::format("volume change  {:+.3f} %\n", 100 * result.volume_change());
  text += fmt::format("smoothing took {:.2f} s", result.seconds());
  return text;
}

void print_warnings(const v1::Job& job) {
  for (const v1::Warning& warning : job.warnings()) {
    print_warning(warning.code(), warning.detail());
  }
}

void print_warning(std::string_view code, std::string_view detail) {
  fmt::print(stderr, "warning: {}: {}\n", code, detail);
}

}  // namespace crease::client
