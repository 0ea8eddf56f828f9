#include "proto/convert.h"

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>
#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <bit>

#include "core/base/text.h"
#include "core/error.h"
#include "proto/parameter_table.h"

namespace crease {
namespace {

constexpr std::size_t kFingerprintDigits = 20;

nlohmann::ordered_json result_parameters(const v1::Parameters& resolved) {
  nlohmann::ordered_json parameters = to_json(resolved);
  for (const Parameter& parameter : parameter_table()) {
    if (!parameter.changes_result) parameters.erase(std::string(parameter.name));
  }
  return parameters;
}

void require_fit(bool fits, std::string_view what) {
  if (!fits) throw Error(code::kInternal, fmt::format("a stored mesh is damaged: wrong number or range of {}", what));
}

std::string_view bytes_of(const std::vector<double>& numbers) {
  static_assert(std::endian::native == std::endian::little);
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(double)};
}

v1::RidgeLine to_message(const RidgeLine& line) {
  v1::RidgeLine message;
  message.mutable_vertices()->Add(line.vertices.begin(), line.vertices.end());
  message.set_closed(line.closed);
  message.set_length(line.length);
  message.set_mean_label(line.mean_label);
  message.set_mean_dihedral_rad(line.mean_dihedral_rad);
  return message;
}

RidgeLine from_message(const v1::RidgeLine& message) {
  return {.vertices = {message.vertices().begin(), message.vertices().end()},
          .closed = message.closed(),
          .length = message.length(),
          .mean_label = message.mean_label(),
          .mean_dihedral_rad = message.mean_dihedral_rad()};
}

void add_features(const LabelledMesh& mesh, v1::LabelledMesh& message) {
  for (const VertexClass one : mesh.classes) message.add_classes(static_cast<std::uint32_t>(one));
  message.mutable_sigma()->Add(mesh.sigma.begin(), mesh.sigma.end());
  message.mutable_segments()->Add(mesh.segments.begin(), mesh.segments.end());
  for (const RidgeLine& line : mesh.ridge_lines) *message.add_ridge_lines() = to_message(line);
  message.mutable_corners()->Add(mesh.corners.begin(), mesh.corners.end());
}

/// Reads classes, deviations, segments and ridge lines into `mesh`, which has its positions and triangles already.
void read_features(const v1::LabelledMesh& message, LabelledMesh& mesh) {
  constexpr auto kLastClass = static_cast<std::uint32_t>(VertexClass::kCorner);
  const auto in_range = [&](Index index) { return index < mesh.mesh.positions.size(); };
  const auto fits = [](int size, std::size_t whole) { return size == 0 || static_cast<std::size_t>(size) == whole; };
  require_fit(fits(message.classes_size(), mesh.mesh.positions.size()), "vertex classes");
  require_fit(fits(message.sigma_size(), mesh.mesh.positions.size()), "vertex deviations");
  require_fit(fits(message.segments_size(), mesh.mesh.triangles.size()), "face segments");
  require_fit(std::ranges::all_of(message.corners(), in_range), "ridge corners");
  for (const std::uint32_t one : message.classes()) {
    require_fit(one <= kLastClass, "vertex classes");
    mesh.classes.push_back(static_cast<VertexClass>(one));
  }
  mesh.sigma.assign(message.sigma().begin(), message.sigma().end());
  mesh.segments.assign(message.segments().begin(), message.segments().end());
  mesh.corners.assign(message.corners().begin(), message.corners().end());
  for (const v1::RidgeLine& line : message.ridge_lines()) {
    require_fit(std::ranges::all_of(line.vertices(), in_range), "ridge line vertices");
    mesh.ridge_lines.push_back(from_message(line));
  }
}

}  // namespace

v1::InputFacts to_message(const InputFacts& facts) {
  v1::InputFacts message;
  message.set_vertices(facts.vertices);
  message.set_faces(facts.faces);
  message.set_edges(facts.edges);
  message.set_boundary_edges(facts.boundary_edges);
  message.set_nonmanifold_edges(facts.nonmanifold_edges);
  message.set_coincident_vertices(facts.coincident_vertices);
  message.set_degenerate_faces(facts.degenerate_faces);
  message.set_duplicate_faces(facts.duplicate_faces);
  message.set_isolated_vertices(facts.isolated_vertices);
  message.set_flipped_faces(facts.flipped_faces);
  message.set_components(facts.components);
  message.set_mean_edge_length(facts.mean_edge_length);
  message.set_noise_sigma(facts.noise_sigma);
  return message;
}

v1::InputFacts to_message(const CheckedInput& input) {
  v1::InputFacts message = to_message(input.facts);
  message.set_format(std::string(format_name(input.format)));
  *message.mutable_attributes() = {input.attributes.begin(), input.attributes.end()};
  if (!input.weights.empty()) message.set_weights_sha256(sha256_hex(bytes_of(input.weights)));
  return message;
}

v1::Energy to_message(const Energy& energy) {
  v1::Energy message;
  for (std::size_t term = 0; term < kTermCount; ++term) {
    const auto* field = v1::Energy::descriptor()->FindFieldByNumber(kTermNames[term].field);
    v1::Energy::GetReflection()->SetDouble(&message, field, energy[term]);
  }
  message.set_total(energy.total());
  return message;
}

v1::Progress to_message(const SweepView& view) {
  const double fraction = view.fraction.value_or(static_cast<double>(view.record.sweep) / view.sweeps);
  v1::Progress message;
  message.set_fraction(fraction);
  message.set_stage("smoothing");
  message.set_sweep(view.record.sweep);
  message.set_sweeps(view.sweeps);
  message.set_temperature(view.record.temperature);
  message.set_acceptance(view.record.acceptance);
  *message.mutable_energy() = to_message(view.record.energy);
  message.set_eta_seconds(view.seconds * (1 - fraction) / fraction);
  return message;
}

v1::Sweep to_message(const SweepRecord& record) {
  v1::Sweep message;
  message.set_sweep(record.sweep);
  *message.mutable_energy() = to_message(record.energy);
  message.set_likelihood_weight(record.likelihood_weight);
  message.set_temperature(record.temperature);
  message.set_label_temperature(record.label_temperature);
  message.set_step_size(record.step_size);
  message.set_acceptance(record.acceptance);
  message.set_label_acceptance(record.label_acceptance);
  message.set_ridge_edges(record.ridge_edges);
  message.set_rms_displacement(record.rms_displacement);
  message.set_stage(std::string(record.stage));
  return message;
}

v1::Choice to_message(const ChoiceReport& report) {
  v1::Choice message;
  message.set_faces(static_cast<std::uint32_t>(report.faces));
  message.set_noise_sigma(report.noise_sigma);
  message.set_noise_sigma_first(report.noise_sigma_first);
  message.set_noise(std::string(words_of(report.direction).at(static_cast<std::size_t>(report.direction))));
  message.set_impulsive(report.impulsive);
  message.set_moved_share(report.moved_share);
  message.set_varying(report.varying);
  message.set_noise_spread(report.noise_spread);
  message.set_correlation_length(report.correlation_length);
  message.set_spikes(static_cast<std::uint32_t>(report.spikes));
  message.set_surface(report.family);
  message.set_weight(report.weight);
  message.set_margin(report.margin);
  for (const CandidateReport& one : report.candidates) {
    v1::Candidate& candidate = *message.add_candidates();
    candidate.set_surface(one.family);
    candidate.set_weight(one.weight);
    candidate.set_expected_error(one.expected_error);
  }
  return message;
}

v1::Uncertainty to_message(const UncertaintyFacts& facts) {
  v1::Uncertainty message;
  message.set_mean(facts.mean);
  message.set_median(facts.median);
  message.set_max(facts.max);
  return message;
}

v1::ResultFacts to_message(const ResultFacts& facts) {
  v1::ResultFacts message;
  if (facts.choice) *message.mutable_choice() = to_message(*facts.choice);
  for (const ChoiceReport& other : facts.other_choices) *message.add_other_choices() = to_message(other);
  if (facts.uncertainty) *message.mutable_uncertainty() = to_message(*facts.uncertainty);
  message.set_ridge_edges(facts.ridge_edges);
  message.set_ridge_length(facts.ridge_length);
  message.set_max_displacement(facts.max_displacement);
  message.set_rms_displacement(facts.rms_displacement);
  message.set_volume_change(facts.volume_change);
  message.set_seconds(facts.seconds);
  message.set_ridge_lines(facts.ridge_lines);
  message.set_corners(facts.corners);
  message.set_segments(facts.segments);
  return message;
}

v1::Warning to_message(const Warning& warning) {
  v1::Warning message;
  message.set_code(warning.code);
  message.set_detail(warning.detail);
  return message;
}

void add_once(const v1::Warning& warning, google::protobuf::RepeatedPtrField<v1::Warning>& warnings) {
  const bool known = std::ranges::any_of(warnings, [&](const v1::Warning& old) {
    return old.code() == warning.code() && old.detail() == warning.detail();
  });
  if (!known) *warnings.Add() = warning;
}

v1::LabelledMesh to_message(const LabelledMesh& mesh) {
  v1::LabelledMesh message;
  message.mutable_positions()->Reserve(static_cast<int>(3 * mesh.mesh.positions.size()));
  for (const Vec3& position : mesh.mesh.positions) {
    for (const double coordinate : position) message.add_positions(coordinate);
  }
  message.mutable_triangles()->Reserve(static_cast<int>(3 * mesh.mesh.triangles.size()));
  for (const Triangle& triangle : mesh.mesh.triangles) {
    for (const Index corner : triangle) message.add_triangles(corner);
  }
  message.mutable_edges()->Reserve(static_cast<int>(2 * mesh.edges.size()));
  for (const Edge& edge : mesh.edges) {
    message.add_edges(edge.v0);
    message.add_edges(edge.v1);
  }
  message.mutable_labels()->Add(mesh.labels.begin(), mesh.labels.end());
  message.mutable_dihedral_rad()->Add(mesh.dihedral_rad.begin(), mesh.dihedral_rad.end());
  add_features(mesh, message);
  return message;
}

InputFacts from_message(const v1::InputFacts& message) {
  return {.vertices = message.vertices(),
          .faces = message.faces(),
          .edges = message.edges(),
          .boundary_edges = message.boundary_edges(),
          .nonmanifold_edges = message.nonmanifold_edges(),
          .coincident_vertices = message.coincident_vertices(),
          .degenerate_faces = message.degenerate_faces(),
          .duplicate_faces = message.duplicate_faces(),
          .isolated_vertices = message.isolated_vertices(),
          .flipped_faces = message.flipped_faces(),
          .components = message.components(),
          .mean_edge_length = message.mean_edge_length(),
          .noise_sigma = message.noise_sigma()};
}

ResultFacts from_message(const v1::ResultFacts& message) {
  return {.ridge_edges = message.ridge_edges(),
          .ridge_length = message.ridge_length(),
          .ridge_lines = message.ridge_lines(),
          .corners = message.corners(),
          .segments = message.segments(),
          .max_displacement = message.max_displacement(),
          .rms_displacement = message.rms_displacement(),
          .volume_change = message.volume_change(),
          .seconds = message.seconds(),
          .choice = {},
          .other_choices = {},
          .uncertainty = {}};
}

LabelledMesh from_message(const v1::LabelledMesh& message) {
  const int edges = message.labels_size();
  require_fit(message.positions_size() % 3 == 0, "coordinates");
  require_fit(message.triangles_size() % 3 == 0, "corners");
  require_fit(message.edges_size() == 2 * edges && message.dihedral_rad_size() == edges, "edges");
  const auto vertices = static_cast<Index>(message.positions_size() / 3);
  const auto in_range = [&](Index index) { return index < vertices; };
  require_fit(std::ranges::all_of(message.triangles(), in_range), "face corners");
  require_fit(std::ranges::all_of(message.edges(), in_range), "edge vertices");

  LabelledMesh mesh;
  mesh.mesh.positions.reserve(vertices);
  for (int i = 0; i < message.positions_size(); i += 3) {
    mesh.mesh.positions.emplace_back(message.positions(i), message.positions(i + 1), message.positions(i + 2));
  }
  mesh.mesh.triangles.reserve(static_cast<std::size_t>(message.triangles_size()) / 3);
  for (int i = 0; i < message.triangles_size(); i += 3) {
    mesh.mesh.triangles.push_back({message.triangles(i), message.triangles(i + 1), message.triangles(i + 2)});
  }
  mesh.edges.reserve(static_cast<std::size_t>(edges));
  for (int e = 0; e < edges; ++e) mesh.edges.push_back({message.edges(2 * e), message.edges(2 * e + 1)});
  mesh.labels.assign(message.labels().begin(), message.labels().end());
  mesh.dihedral_rad.assign(message.dihedral_rad().begin(), message.dihedral_rad().end());
  read_features(message, mesh);
  return mesh;
}

std::string json_text(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  options.always_print_primitive_fields = true;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(message, &text, options);
  if (!status.ok()) throw Error(code::kInternal, "a message cannot be written as JSON: " + status.ToString());
  return text;
}

nlohmann::ordered_json to_json(const google::protobuf::Message& message) {
  return nlohmann::ordered_json::parse(json_text(message));
}

std::string job_fingerprint(const v1::InputFacts& input, const v1::Parameters& resolved) {
  const std::string text = fmt::format("creased {}\n{}\n{}\n{}\n{}", CREASE_VERSION, input.sha256(), input.format(),
                                       input.weights_sha256(), result_parameters(resolved).dump());
  return sha256_hex(text).substr(0, kFingerprintDigits);
}

nlohmann::ordered_json mesh_extras(const std::string& fingerprint, const v1::Parameters& resolved,
                                   const InputFacts& input, const ResultFacts& result) {
  return {{"job", fingerprint},
          {"version", CREASE_VERSION},
          {"parameters", result_parameters(resolved)},
          {"counts",
           {{"vertices", input.vertices},
            {"faces", input.faces},
            {"edges", input.edges},
            {"boundary_edges", input.boundary_edges},
            {"nonmanifold_edges", input.nonmanifold_edges},
            {"components", input.components},
            {"ridge_edges", result.ridge_edges},
            {"ridge_lines", result.ridge_lines},
            {"corners", result.corners},
            {"segments", result.segments}}}};
}

std::string sha256_hex(std::string_view bytes) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  if (EVP_Digest(bytes.data(), bytes.size(), digest.data(), &size, EVP_sha256(), nullptr) != 1) {
    throw Error(code::kInternal, "SHA-256 is not available");
  }
  return hex({digest.data(), size});
}

}  // namespace crease
