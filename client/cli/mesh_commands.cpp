#include <fmt/format.h>

#include <filesystem>

#include "client/cli/commands.h"
#include "client/cli/failure.h"
#include "client/cli/files.h"
#include "core/io/decode.h"
#include "core/io/dropped_attributes.h"
#include "core/io/formats.h"
#include "core/measure/measure.h"
#include "core/measure/noise.h"

namespace crease::client {
namespace {

using Json = nlohmann::ordered_json;

struct NoiseOptions {
  Console console;
  std::filesystem::path input, output;
  std::string format;
  double sigma = 0;
  std::uint64_t seed = 1;
  std::string kind = "gaussian";
};

struct MeasureOptions {
  Console console;
  std::filesystem::path reference, mesh, labels;
};

DecodedMesh read_mesh(const std::filesystem::path& path) {
  return decode_mesh(read_file(path), format_from_filename(path.string()));
}

/// A mesh without ridges.
LabelledMesh unlabelled(Mesh mesh, Appearance appearance) {
  LabelledMesh result;
  result.appearance = std::move(appearance);
  const Topology topology = build_topology(mesh);
  result.edges = topology.edges;
  result.labels.assign(topology.edges.size(), 0);
  result.dihedral_rad = signed_dihedral_angles(mesh, topology, mesh.positions);
  result.mesh = std::move(mesh);
  return result;
}

ExitCode noise(const NoiseOptions& options) {
  const Format& format = output_format(options.format, options.output);
  const NoiseKind kind = noise_kind_from_name(options.kind);
  DecodedMesh input = read_mesh(options.input);
  Mesh noisy = add_noise(input.mesh, options.sigma, options.seed, kind);
  const std::size_t vertices = noisy.positions.size(), faces = noisy.triangles.size();
  const Json extras = {{"noise", {{"kind", options.kind}, {"sigma", options.sigma}, {"seed", options.seed}}}};
  if (const std::string dropped = dropped_text(format, attributes_of(input.appearance, input.mesh.triangles));
      !dropped.empty()) {
    print_warning(kAttributesDropped, dropped);
  }
  write_file(options.output, format.write(unlabelled(std::move(noisy), std::move(input.appearance)), extras, {}));
  options.console.result({{"file", options.output.string()},
                          {"vertices", vertices},
                          {"faces", faces},
                          {"kind", options.kind},
                          {"sigma", options.sigma},
                          {"seed", options.seed}},
                         fmt::format("wrote {}: {} vertices, {} noise of {} edge lengths", options.output.string(),
                                     vertices, options.kind, options.sigma));
  return ExitCode::kOk;
}

/// Reads a labels file as the service writes it.
EdgeLabels read_labels(const std::filesystem::path& path) {
  try {
    const Json json = Json::parse(read_file(path));
    EdgeLabels labels;
    for (const auto& edge : json.at("edges")) labels.edges.push_back({edge.at(0), edge.at(1)});
    labels.labels = json.at("labels").get<std::vector<double>>();
    if (labels.labels.size() == labels.edges.size()) return labels;
  } catch (const Json::exception& error) {
    throw Failure(Error(code::kJsonInvalid, fmt::format("{} is not a labels file: {}", path.string(), error.what())));
  }
  throw Failure(Error(code::kJsonInvalid, fmt::format("{} does not have one label per edge", path.string())));
}

Json to_json(const Measurement& measurement) {
  Json json = {{"mean_normal_error_deg", measurement.mean_normal_error_deg},
               {"max_normal_error_deg", measurement.max_normal_error_deg},
               {"mean_vertex_error", measurement.mean_vertex_error},
               {"max_vertex_error", measurement.max_vertex_error},
               {"volume_change", measurement.volume_change}};
  if (measurement.labels) {
    json["labels"] = {{"precision", measurement.labels->precision},
                      {"recall", measurement.labels->recall},
                      {"f1", measurement.labels->f1},
                      {"reference_ridges", measurement.labels->reference_ridges},
                      {"labelled_ridges", measurement.labels->labelled_ridges}};
  }
  return json;
}

std::string to_text(const Measurement& measurement) {
  std::string text = fmt::format("normal error   mean {:.2f}°, max {:.2f}°\n", measurement.mean_normal_error_deg,
                                 measurement.max_normal_error_deg);
  text += fmt::format("vertex error   mean {:.4f}, max {:.4f} edge lengths\n", measurement.mean_vertex_error,
                      measurement.max_vertex_error);
  text += fmt::format("volume change  {:+.3f} %", 100 * measurement.volume_change);
  if (measurement.labels) {
    text += fmt::format("\nridge labels   precision {:.3f}, recall {:.3f}, F1 {:.3f}", measurement.labels->precision,
                        measurement.labels->recall, measurement.labels->f1);
  }
  return text;
}

ExitCode measure_meshes(const MeasureOptions& options) {
  const Mesh reference = read_mesh(options.reference).mesh;
  const Mesh mesh = read_mesh(options.mesh).mesh;
  const EdgeLabels labels = options.labels.empty() ? EdgeLabels{} : read_labels(options.labels);
  const Measurement measurement = measure(reference, mesh, options.labels.empty() ? nullptr : &labels);
  options.console.result(to_json(measurement), to_text(measurement));
  return ExitCode::kOk;
}

void add_noise_command(CLI::App& app, Run& run) {
  CLI::App& command = *app.add_subcommand("noise", "Make a test input: move the vertices of a mesh randomly");
  auto options = std::make_shared<NoiseOptions>();
  command.add_option("input", options->input, "Mesh: " + name_list(formats_with(&Format::read)))->required();
  command.add_option("-o,--output", options->output, "Output file; by default its extension gives the format")
      ->required();
  command.add_option("--format", options->format, "Format of the output: " + name_list(formats_with(&Format::write)));
  command.add_option("--sigma", options->sigma, "Standard deviation in mean edge lengths, 0 or more")->required();
  command.add_option("--seed", options->seed, "The same seed gives the same noise")->capture_default_str();
  command
      .add_option(
          "--kind", options->kind,
          "gaussian moves every coordinate, normal moves along the normals, impulsive does so for half of the vertices")
      ->capture_default_str();
  add_console_options(command, options->console);
  run_with(command, run, options, noise);
}

void add_measure_command(CLI::App& app, Run& run) {
  CLI::App& command =
      *app.add_subcommand("measure", "Measure the errors of a mesh against a reference with the same faces");
  auto options = std::make_shared<MeasureOptions>();
  command.add_option("reference", options->reference, "Noise-free mesh")->required();
  command.add_option("mesh", options->mesh, "Mesh to measure")->required();
  command.add_option("--labels", options->labels, "Also measure these ridge labels of the mesh, in JSON");
  add_console_options(command, options->console);
  run_with(command, run, options, measure_meshes);
}

}  // namespace

void add_mesh_commands(CLI::App& app, Run& run) {
  add_noise_command(app, run);
  add_measure_command(app, run);
}

}  // namespace crease::client
