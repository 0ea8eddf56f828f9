#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/features/features.h"
#include "core/io/vertex_weights.h"
#include "core/job.h"
#include "core/job_surface.h"
#include "tests/fuzz/properties.h"
#include "tests/fuzz/target.h"
#include "tests/fuzz/targets.h"

namespace crease::fuzz {
namespace {

constexpr DecodeLimits kLimits{2'000, 4'000};

void require_checked(const CheckedInput& input) {
  require_sound(input.mesh);
  require(input.mesh.positions.size() <= kLimits.max_vertices, "no more vertices than the limit");
  require(input.mesh.triangles.size() <= kLimits.max_faces, "no more faces than the limit");
  require(input.facts.vertices == input.mesh.positions.size(), "every vertex is counted");
  require(input.facts.faces == input.mesh.triangles.size(), "every face is counted");
  const Topology& topology = input.welded ? input.welded->topology : input.topology;
  require(input.facts.edges == topology.edges.size(), "every edge is counted");
  require(input.facts.mean_edge_length > 0 && std::isfinite(input.facts.mean_edge_length), "the mesh has an extent");
  require(input.facts.noise_sigma >= 0 && std::isfinite(input.facts.noise_sigma), "the noise is a number");
  require(input.weights.empty() || input.weights.size() == input.mesh.positions.size(), "one weight per vertex");
  require(std::ranges::all_of(input.weights, is_weight), "weights are in range");
  for (const Warning& warning : input.warnings) {
    require(!warning.code.empty(), "a warning has a code");
    require_utf8(warning.detail, "a warning");
  }
}

/// The mesh with labels that depend only on the numbers of the edges, and with the features that follow from them.
LabelledMesh labelled(const CheckedInput& input) {
  LabelledMesh result;
  result.mesh = input.mesh;
  result.edges = input.topology.edges;
  // As in a job, of the faces that have an area: those of the others may be no numbers.
  const JobSurface surface(input, 0);
  const Mesh& mesh = surface.mesh();
  std::vector<double> labels;
  for (std::size_t e = 0; e < surface.topology().edges.size(); ++e) {
    labels.push_back(surface.topology().is_interior(e) ? static_cast<double>(e * 7 % 11) / 10 : 0.0);
  }
  result.labels = surface.upload_edges(labels);
  result.dihedral_rad = surface.upload_edges(signed_dihedral_angles(mesh, surface.topology(), mesh.positions));
  Features features = find_features(input.mesh, input.topology, input.mesh.positions, result.labels);
  require(features.classes.size() == input.mesh.positions.size(), "every vertex has a class");
  require(features.segments.size() == input.mesh.triangles.size(), "every face has a segment");
  require(std::ranges::all_of(features.segments, [&](Index s) { return s < features.segment_count; }),
          "segments are numbered from 0");
  result.classes = std::move(features.classes);
  result.segments = std::move(features.segments);
  result.ridge_lines = std::move(features.ridge_lines);
  result.corners = std::move(features.corners);
  return result;
}

Mesh in_single_precision(Mesh mesh) {
  for (Vec3& position : mesh.positions) position = position.cast<float>().cast<double>();
  return mesh;
}

/// Whether the vertices that the format writes fit into single precision. STL writes only the corners of faces.
bool fits_single_precision(const Mesh& mesh, MeshFormat format) {
  const auto fits = [&](const Vec3& p) { return p.cast<float>().allFinite(); };
  if (format != MeshFormat::kStl) return std::ranges::all_of(mesh.positions, fits);
  return std::ranges::all_of(mesh.triangles, [&](const Triangle& face) {
    return std::ranges::all_of(face, [&](Index vertex) { return fits(mesh.positions[vertex]); });
  });
}

/// Compression, of which half of the results get some, loses nothing.
Mesh decoded_again(const LabelledMesh& result, MeshFormat format) {
  const MeshStyle style{.compressed = format_row(format).has_compression && result.edges.size() % 2 == 0};
  const std::string bytes = encode_mesh(result, format, {}, style);
  return decode_mesh(bytes, format, {16 * kLimits.max_vertices, kLimits.max_faces}).mesh;
}

/// glTF is written relative to the middle of a mesh that is far from the origin, with the digits that its size leaves.
bool are_near(const Mesh& mesh, const Mesh& again) {
  if (mesh.positions.size() != again.positions.size()) return false;
  Eigen::AlignedBox3d box;
  for (const Vec3& position : mesh.positions) box.extend(position);
  const double digits = box.diagonal().maxCoeff() * static_cast<double>(std::numeric_limits<float>::epsilon());
  return std::ranges::equal(mesh.positions, again.positions, [&](const Vec3& one, const Vec3& other) {
    return (one - other).cwiseAbs().maxCoeff() <= digits;
  });
}

void require_same(const Mesh& mesh, const Mesh& again, MeshFormat format) {
  const bool is_gltf = format == MeshFormat::kGltf || format == MeshFormat::kGlb;
  const bool kept = is_gltf ? in_single_precision(mesh).positions == again.positions || are_near(mesh, again)
                            : mesh.positions == again.positions;
  require(kept, std::string(format_name(format)) + " keeps the vertices");
  require(mesh.triangles == again.triangles, std::string(format_name(format)) + " keeps the faces");
}

/// Compares the corners of all faces, since STL has no shared vertices.
void require_same_corners(const Mesh& mesh, const Mesh& again) {
  require(mesh.triangles.size() == again.triangles.size(), "stl keeps the faces");
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      require(mesh.positions[mesh.triangles[f][k]] == again.positions[again.triangles[f][k]], "stl keeps the corners");
    }
  }
}

/// Writes the mesh in `format` and reads it back.
void require_round_trip(const LabelledMesh& result, MeshFormat format) {
  const bool is_single = format == MeshFormat::kStl || format == MeshFormat::kGltf || format == MeshFormat::kGlb;
  if (is_single && !fits_single_precision(result.mesh, format)) {
    require(refused([&] { encode_mesh(result, format); }), "coordinates that do not fit are refused");
    return;
  }
  const Mesh again = decoded_again(result, format);
  if (format == MeshFormat::kStl) return require_same_corners(in_single_precision(result.mesh), again);
  require_same(result.mesh, again, format);
}

void require_json(const LabelledMesh& result) {
  const auto mesh = nlohmann::json::parse(encode_mesh(result, MeshFormat::kJson));
  require(mesh["positions"].size() == result.mesh.positions.size(), "json has every vertex");
  const auto labels = nlohmann::json::parse(write_labels_json(result));
  require(labels["count"] == result.edges.size(), "the labels have every edge");
  const auto ridges = nlohmann::json::parse(write_ridges_json(result, {}));
  require(ridges["count"] == result.ridge_lines.size(), "the ridges have every line");
}

void run(std::string_view bytes, MeshFormat format) {
  CheckedInput input;
  if (refused([&] { input = check_input(bytes, format, kLimits); })) return;
  require_checked(input);
  LabelledMesh result = labelled(input);
  result.appearance = decode_mesh(bytes, format, kLimits).appearance;
  // One output format per input, so that the fuzzer tries more inputs.
  const MeshFormat written = kMeshFormats[std::hash<std::string_view>{}(bytes) % kMeshFormats.size()];
  if (written == MeshFormat::kJson) return require_json(result);
  if (format_row(written).read != nullptr && format_row(written).write != nullptr) require_round_trip(result, written);
}

}  // namespace

void fuzz_obj(std::string_view bytes) { run(bytes, MeshFormat::kObj); }
void fuzz_ply(std::string_view bytes) { run(bytes, MeshFormat::kPly); }
void fuzz_off(std::string_view bytes) { run(bytes, MeshFormat::kOff); }
void fuzz_stl(std::string_view bytes) { run(bytes, MeshFormat::kStl); }
void fuzz_gltf(std::string_view bytes) { run(bytes, MeshFormat::kGltf); }
void fuzz_glb(std::string_view bytes) { run(bytes, MeshFormat::kGlb); }

void fuzz_weights(std::string_view bytes) {
  if (bytes.empty()) return;
  const std::size_t vertices = static_cast<unsigned char>(bytes.front());
  std::vector<double> weights;
  if (refused([&] { weights = read_weights(bytes.substr(1), vertices); })) return;
  require(weights.size() == vertices, "one weight per vertex");
  require(std::ranges::all_of(weights, is_weight), "weights are in range");
  require(read_weights(nlohmann::json(weights).dump(), vertices) == weights,
          "weights that were written read back equal");
}

}  // namespace crease::fuzz
