#include "client/cli/console.h"

#include <fmt/format.h>

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

std::string figures(const v1::Job& job) {
  const v1::InputFacts& input = job.input();
  const v1::ResultFacts& result = job.result();
  std::string text = fmt::format("job            {}\n", job.id());
  text += fmt::format("input          {} vertices, {} faces, noise about {:.2g} edge lengths\n", input.vertices(),
                      input.faces(), input.noise_sigma());
  text += fmt::format("ridges         {} edges in {} lines, length {:.5g}\n", result.ridge_edges(),
                      result.ridge_lines(), result.ridge_length());
  text += fmt::format("displacement   rms {:.3g}, max {:.3g} edge lengths\n", result.rms_displacement(),
                      result.max_displacement());
  text += fmt::format("volume change  {:+.3f} %\n", 100 * result.volume_change());
  text += fmt::format("smoothing took {:.2f} s", result.seconds());
  return text;
}

void print_warnings(const v1::Job& job) {
  for (const v1::Warning& warning : job.warnings()) {
    fmt::print(stderr, "warning: {}: {}\n", warning.code(), warning.detail());
  }
}

}  // namespace crease::client
