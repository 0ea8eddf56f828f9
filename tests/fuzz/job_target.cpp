#include <algorithm>
#include <cmath>

#include "core/job.h"
#include "proto/parameter_table.h"
#include "tests/fuzz/lines.h"
#include "tests/fuzz/properties.h"
#include "tests/fuzz/target.h"
#include "tests/fuzz/targets.h"

namespace crease::fuzz {
namespace {

constexpr DecodeLimits kFuzzedLimits{100, 200};

/// Parameters that cause little work, so that each input runs fast.
v1::Parameters of_little_work(v1::Parameters parameters) {
  if (parameters.has_sweeps()) parameters.set_sweeps(std::min(parameters.sweeps(), 4U));
  if (parameters.has_rounds()) parameters.set_rounds(std::min(parameters.rounds(), 2U));
  if (parameters.has_fit_steps()) parameters.set_fit_steps(std::min(parameters.fit_steps(), 3U));
  if (parameters.has_iterations()) parameters.set_iterations(std::min(parameters.iterations(), 3U));
  if (parameters.has_fitting_steps()) parameters.set_fitting_steps(std::min(parameters.fitting_steps(), 3U));
  parameters.set_threads(1);
  return parameters;
}

void require_result(const CheckedInput& input, const JobOutput& output) {
  require_sound(output.result.mesh);
  require(output.result.mesh.triangles == input.mesh.triangles, "faces stay as they are");
  require(output.result.mesh.positions.size() == input.mesh.positions.size(), "vertices keep their number");
  require(output.result.labels.size() == input.topology.edges.size(), "every edge has a label");
  require(std::ranges::all_of(output.result.labels, [](double label) { return label >= 0 && label <= 1; }),
          "labels are from 0 to 1");
  require(std::ranges::all_of(output.result.dihedral_rad, [](double angle) { return std::isfinite(angle); }),
          "angles are finite");
  for (const double fact : {output.facts.ridge_length, output.facts.max_displacement, output.facts.rms_displacement,
                            output.facts.volume_change}) {
    require(std::isfinite(fact), "facts of the result are finite");
  }
}

}  // namespace

void fuzz_job(std::string_view bytes) {
  v1::Parameters parameters;
  CheckedInput input;
  const bool is_refused = refused([&] {
    while (!bytes.empty() && bytes.front() != '\n') {
      const auto [name, value] = take_pair(bytes);
      set_parameter(parameters, name, value);
    }
    parameters = of_little_work(resolve(parameters));
    input = check_input(bytes, MeshFormat::kOff, kFuzzedLimits);
  });
  if (is_refused) return;
  RunContext context;
  require_result(input, run_job(input, to_options(parameters), context));
}

}  // namespace crease::fuzz
