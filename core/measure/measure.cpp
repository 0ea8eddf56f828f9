#include "core/measure/measure.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.h"

namespace crease {
namespace {

constexpr double kDegrees = 180 / M_PI;

void require_same_faces(const Mesh& reference, const Mesh& mesh) {
  const auto require_count = [](std::string_view what, std::size_t expected, std::size_t found) {
    if (expected == found) return;
    throw Error(code::kMeshMismatch, fmt::format("the reference has {} {}, the mesh has {}", expected, what, found));
  };
  require_count("vertices", reference.positions.size(), mesh.positions.size());
  require_count("faces", reference.triangles.size(), mesh.triangles.size());
  const auto [expected, found] =
      std::mismatch(reference.triangles.begin(), reference.triangles.end(), mesh.triangles.begin());
  if (expected == reference.triangles.end()) return;
  const auto face = expected - reference.triangles.begin();
  throw Error(code::kMeshMismatch,
              fmt::format("face {} has the vertices {}, {}, {} in the reference and {}, {}, {} in the mesh", face,
                          (*expected)[0], (*expected)[1], (*expected)[2], (*found)[0], (*found)[1], (*found)[2]),
              fmt::format("face {}", face));
}

double angle_between(const Vec3& a, const Vec3& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

void measure_normals(const Mesh& reference, const Topology& topology, const Mesh& mesh, Measurement& result) {
  const std::vector<Vec3> expected = face_normals(reference, topology, reference.positions);
  const std::vector<Vec3> found = face_normals(reference, topology, mesh.positions);
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t face = 0; face < expected.size(); ++face) {
    if (expected[face].isZero(0) || found[face].isZero(0)) continue;
    const double error_deg = angle_between(expected[face], found[face]) * kDegrees;
    sum += error_deg;
    ++count;
    result.max_normal_error_deg = std::max(result.max_normal_error_deg, error_deg);
  }
  if (count > 0) result.mean_normal_error_deg = sum / static_cast<double>(count);
}

void measure_vertices(const Mesh& reference, double length_unit, const Mesh& mesh, Measurement& result) {
  double sum = 0;
  for (std::size_t vertex = 0; vertex < mesh.positions.size(); ++vertex) {
    const double error = (mesh.positions[vertex] - reference.positions[vertex]).stableNorm() / length_unit;
    sum += error;
    result.max_vertex_error = std::max(result.max_vertex_error, error);
  }
  result.mean_vertex_error = sum / static_cast<double>(mesh.positions.size());
}

Edge ordered(const Edge& edge) { return {std::min(edge.v0, edge.v1), std::max(edge.v0, edge.v1)}; }

bool comes_before(const Edge& a, const Edge& b) { return a.v0 != b.v0 ? a.v0 < b.v0 : a.v1 < b.v1; }

/// Labels in the order of the topology's edges.
std::vector<double> match_labels(const Topology& topology, const EdgeLabels& given) {
  if (given.edges.size() != given.labels.size()) {
    throw Error(code::kMeshMismatch,
                fmt::format("there are {} labels for {} edges", given.labels.size(), given.edges.size()));
  }
  std::vector<std::uint32_t> by_vertices(topology.edges.size());
  std::iota(by_vertices.begin(), by_vertices.end(), 0U);
  std::sort(by_vertices.begin(), by_vertices.end(),
            [&](std::uint32_t a, std::uint32_t b) { return comes_before(topology.edges[a], topology.edges[b]); });
  std::vector<double> labels(topology.edges.size(), 0);
  for (std::size_t i = 0; i < given.edges.size(); ++i) {
    const Edge edge = ordered(given.edges[i]);
    const auto place = std::lower_bound(
        by_vertices.begin(), by_vertices.end(), edge,
        [&](std::uint32_t number, const Edge& wanted) { return comes_before(topology.edges[number], wanted); });
    if (place == by_vertices.end() || topology.edges[*place] != edge) {
      throw Error(code::kMeshMismatch,
                  fmt::format("label {} is for an edge between vertices {} and {}, which does not exist", i,
                              given.edges[i].v0, given.edges[i].v1),
                  fmt::format("label {}", i));
    }
    labels[*place] = given.labels[i];
  }
  return labels;
}

LabelScore score_labels(const Mesh& reference, const Topology& topology, const std::vector<double>& labels) {
  const std::vector<double> angles = signed_dihedral_angles(reference, topology, reference.positions);
  LabelScore score;
  std::uint32_t agreed = 0;
  for (std::size_t edge = 0; edge < topology.edges.size(); ++edge) {
    if (!topology.is_interior(edge)) continue;
    const bool is_ridge = std::abs(angles[edge]) * kDegrees > kReferenceRidgeDeg;
    const bool is_labelled = crease::is_ridge(labels[edge]);
    score.reference_ridges += is_ridge ? 1 : 0;
    score.labelled_ridges += is_labelled ? 1 : 0;
    agreed += is_ridge && is_labelled ? 1 : 0;
  }
  const auto share = [&](std::uint32_t whole) {
    if (whole > 0) return static_cast<double>(agreed) / whole;
    return score.reference_ridges == score.labelled_ridges ? 1.0 : 0.0;
  };
  score.precision = share(score.labelled_ridges);
  score.recall = share(score.reference_ridges);
  const double sum = score.precision + score.recall;
  score.f1 = sum > 0 ? 2 * score.precision * score.recall / sum : 0;
  return score;
}

/// The volume inside the faces as oriented by the topology. Measured from a vertex of the mesh, so that a mesh far from
/// the origin loses no digits.
double signed_volume(const Mesh& mesh, const Topology& topology, const std::vector<Vec3>& positions) {
  const Vec3& origin = positions[mesh.triangles.front()[0]];
  double six_volumes = 0;
  for (std::size_t face = 0; face < mesh.triangles.size(); ++face) {
    const auto [a, b, c] = oriented(mesh, topology, face);
    six_volumes += (positions[a] - origin).dot((positions[b] - origin).cross(positions[c] - origin));
  }
  return six_volumes / 6;
}

}  // namespace

Measurement measure(const Mesh& reference, const Mesh& mesh, const EdgeLabels* labels) {
  require_same_faces(reference, mesh);
  const Topology topology = build_topology(reference);
  const double length_unit = mean_edge_length(reference.positions, topology.edges);
  if (!(length_unit > 0)) throw Error(code::kMeshNoExtent, "all edges of the reference have length zero");
  Measurement result;
  measure_normals(reference, topology, mesh, result);
  measure_vertices(reference, length_unit, mesh, result);
  result.volume_change = relative_volume_change(reference, topology, mesh.positions);
  if (labels != nullptr) result.labels = score_labels(reference, topology, match_labels(topology, *labels));
  return result;
}

double relative_volume_change(const Mesh& reference, const Topology& topology, const std::vector<Vec3>& positions) {
  for (std::size_t edge = 0; edge < topology.edges.size(); ++edge) {
    if (!topology.is_interior(edge)) return 0;
  }
  if (topology.edges.empty()) return 0;
  const double before = signed_volume(reference, topology, reference.positions);
  if (before == 0) return 0;
  return (signed_volume(reference, topology, positions) - before) / std::abs(before);
}

}  // namespace crease
