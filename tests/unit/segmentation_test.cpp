#include "core/features/segmentation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>

#include "core/features/features.h"
#include "core/features/segment_moves.h"
#include "core/measure/noise.h"
#include "tests/support/labelled_meshes.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

using test::labelled;

Segmentation segments_of(const LabelledMesh& result, const SegmentOptions& options = {}) {
  return segment_faces(result.mesh, build_topology(result.mesh), result.mesh.positions, result.labels, options);
}

std::vector<double> angles_of(const Mesh& mesh, const Topology& topology) {
  return signed_dihedral_angles(mesh, topology, mesh.positions);
}

double triangle_area(const Mesh& mesh, Index face) {
  const auto [a, b, c] = mesh.triangles[face];
  const Vec3 ab = mesh.positions[b] - mesh.positions[a], ac = mesh.positions[c] - mesh.positions[a];
  return std::sqrt(std::max(ab.squaredNorm() * ac.squaredNorm() - std::pow(ab.dot(ac), 2), 0.0)) / 2;
}

/// Number of rings between each vertex and the nearest ridge, at most four, by relaxing all edges repeatedly.
std::vector<int> rings_from_ridges(const Topology& topology, const std::vector<double>& labels) {
  std::vector<int> rings(topology.vertex_edges.size(), 4);
  for (int round = 0; round <= 4; ++round) {
    for (Index e = 0; e < labels.size(); ++e) {
      const auto [v0, v1] = topology.edges[e];
      if (labels[e] >= kRidgeThreshold) rings[v0] = rings[v1] = 0;
      rings[v0] = std::min(rings[v0], rings[v1] + 1);
      rings[v1] = std::min(rings[v1], rings[v0] + 1);
    }
  }
  return rings;
}

/// The energy as the header defines it, with default weights except for a₀.
double brute_force(const Mesh& mesh, const Topology& topology, const std::vector<double>& labels,
                   const std::vector<Index>& segments, double small_area) {
  const std::vector<double> angles = signed_dihedral_angles(mesh, topology, mesh.positions);
  const std::vector<int> rings = rings_from_ridges(topology, labels);
  const double unit = mean_edge_length(mesh.positions, topology.edges);
  double sum = 0;
  for (Index e = 0; e < labels.size(); ++e) {
    if (!topology.is_interior(e)) continue;
    const Edge& edge = topology.edges[e];
    const double length = (mesh.positions[edge.v0] - mesh.positions[edge.v1]).norm() / unit;
    const bool border = segments[topology.edge_faces[e][0]] != segments[topology.edge_faces[e][1]];
    const double bend = angles[e] / (M_PI / 6);
    const double away = 1 + std::min(rings[edge.v0], rings[edge.v1]);
    sum += length * (border ? away * (1 - labels[e]) * std::exp(-bend * bend) : 0.5 * labels[e]);
  }
  double total = 0;
  for (Index f = 0; f < segments.size(); ++f) total += triangle_area(mesh, f);
  std::map<Index, double> areas;
  for (Index f = 0; f < segments.size(); ++f) {
    const double relative = total > 0 ? triangle_area(mesh, f) / (total / static_cast<double>(segments.size())) : 0;
    areas[segments[f]] += std::max(relative, 0.1);
  }
  for (const auto& [segment, area] : areas) sum += small_area > 0 ? 10 * std::max(0.0, 1 - area / small_area) : 0;
  return sum;
}

TEST(Segmentation, EnergyAgreesWithItsDefinition) {
  std::mt19937 random(1);
  for (const auto& member : test::mesh_family()) {
    SCOPED_TRACE(member.name);
    const Topology topology = build_topology(member.mesh);
    std::vector<double> labels = test::random_labels(topology, random);
    for (double& label : labels) label *= random() % 4 == 0 ? 1 : 0.5;
    SegmentOptions options;
    options.small_area = 0.7;
    options.small_fraction = 100;
    const SegmentField field(member.mesh, topology, member.mesh.positions, labels, angles_of(member.mesh, topology),
                             options);
    std::vector<Index> segments(member.mesh.triangles.size());
    for (Index& segment : segments) segment = std::uniform_int_distribution<Index>(0, 5)(random);
    EXPECT_NEAR(field.energy(segments), brute_force(member.mesh, topology, labels, segments, 0.7), 1e-6);
  }
}

/// The smallest energy over all partitions of the faces.
double best_energy(const SegmentField& field, std::vector<Index>& segments, std::size_t face, Index used) {
  if (face == segments.size()) return field.energy(segments);
  double best = 1e9;
  for (Index segment = 0; segment <= used; ++segment) {
    segments[face] = segment;
    best = std::min(best, best_energy(field, segments, face + 1, std::max(used, segment + 1)));
  }
  return best;
}

TEST(Segmentation, IsOptimalOnMostOctahedra) {
  const Mesh mesh{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}},
                  {{0, 1, 2}, {1, 3, 2}, {3, 4, 2}, {4, 0, 2}, {1, 0, 5}, {3, 1, 5}, {4, 3, 5}, {0, 4, 5}}};
  const Topology topology = build_topology(mesh);
  SegmentOptions options;
  options.bend_scale = 3;
  options.ridge_weight = 1;
  std::mt19937 random(2);
  int best_found = 0;
  const int trials = 40;
  for (int trial = 0; trial < trials; ++trial) {
    const std::vector<double> labels = test::random_labels(topology, random);
    const SegmentField field(mesh, topology, mesh.positions, labels, angles_of(mesh, topology), options);
    const double found = field.energy(segment_faces(field).segments);
    std::vector<Index> segments(mesh.triangles.size());
    const double best = best_energy(field, segments, 0, 0);
    EXPECT_GE(found, best - 1e-9);
    best_found += found < best + 1e-9 ? 1 : 0;
  }
  EXPECT_GE(best_found, trials * 3 / 4);
}

TEST(Segmentation, EveryStepLowersTheEnergyAndSegmentsAreConnectedAndNumberedInOrder) {
  std::mt19937 random(3);
  for (const auto& member : test::mesh_family()) {
    SCOPED_TRACE(member.name);
    const Topology topology = build_topology(member.mesh);
    const std::vector<double> labels = test::random_labels(topology, random);
    const SegmentField field(member.mesh, topology, member.mesh.positions, labels, angles_of(member.mesh, topology));
    const Segmentation result = segment_faces(field);
    ASSERT_EQ(result.segments.size(), member.mesh.triangles.size());
    EXPECT_TRUE(std::ranges::is_sorted(result.energies, std::greater()));
    EXPECT_NEAR(field.energy(result.segments), result.energies.back(), 1e-7);
    std::vector<Index> parts = result.segments;
    EXPECT_EQ(split_segments(field, parts), result.count);
    EXPECT_EQ(parts, result.segments);
    Index next = 0;
    for (const Index segment : result.segments) {
      EXPECT_LE(segment, next);
      next = std::max(next, segment + 1);
    }
    EXPECT_EQ(next, result.count);
  }
}

TEST(Segmentation, AnExpansionNeverRaisesTheEnergy) {
  std::mt19937 random(4);
  for (const auto& member : test::mesh_family()) {
    SCOPED_TRACE(member.name);
    const Topology topology = build_topology(member.mesh);
    const std::vector<double> labels = test::random_labels(topology, random);
    const SegmentField field(member.mesh, topology, member.mesh.positions, labels, angles_of(member.mesh, topology));
    std::vector<Index> segments(member.mesh.triangles.size());
    for (Index& segment : segments) segment = std::uniform_int_distribution<Index>(0, 3)(random);
    for (int sweep = 0; sweep < 3; ++sweep) {
      const double before = field.energy(segments);
      expand_segments(field, segments);
      EXPECT_LE(field.energy(segments), before + 1e-9);
    }
  }
}

TEST(Segmentation, FindsKnownParts) {
  EXPECT_EQ(segments_of(labelled(test::cube(1))).count, 6U);
  EXPECT_EQ(segments_of(labelled(test::cube(8))).count, 6U);
  EXPECT_EQ(segments_of(labelled(test::cylinder(24, 6, 1, 2))).count, 3U);
  EXPECT_EQ(segments_of(labelled(test::icosphere(3))).count, 1U);
  EXPECT_EQ(segments_of(labelled(test::grid(7, 7))).count, 1U);
}

/// The plane of each face of the cube, numbered in the order of the first faces.
std::vector<Index> planes(const Mesh& mesh) {
  std::map<std::array<int, 3>, Index> numbers;
  std::vector<Index> result;
  for (const Vec3& normal : face_normals(mesh, build_topology(mesh), mesh.positions)) {
    const std::array<int, 3> key = {static_cast<int>(std::lround(normal.x())),
                                    static_cast<int>(std::lround(normal.y())),
                                    static_cast<int>(std::lround(normal.z()))};
    result.push_back(numbers.try_emplace(key, static_cast<Index>(numbers.size())).first->second);
  }
  return result;
}

TEST(Segmentation, GapsInRidgesAreClosed) {
  LabelledMesh cube = labelled(test::cube(8));
  const std::vector<Index> expected = planes(cube.mesh);
  EXPECT_EQ(segments_of(cube).segments, expected);
  std::mt19937 random(5);
  for (int trial = 0; trial < 20; ++trial) {
    LabelledMesh gapped = cube;
    for (double& label : gapped.labels) {
      if (label == 1 && random() % 6 == 0) label = 0.1;
    }
    EXPECT_EQ(segments_of(gapped).segments, expected);
  }
}

/// A flat square with the label 0.9 on the edges that `choose` selects by their ends.
template <typename Choose>
LabelledMesh square(int size, Choose choose) {
  LabelledMesh result = labelled(test::grid(size, size));
  const Topology topology = build_topology(result.mesh);
  for (Index e = 0; e < result.edges.size(); ++e) {
    const Vec3 &a = result.mesh.positions[result.edges[e].v0], &b = result.mesh.positions[result.edges[e].v1];
    result.labels[e] = topology.is_interior(e) && choose(a, b) ? 0.9 : 0.05;
  }
  return result;
}

TEST(Segmentation, AGapIsClosedEvenWhereTheSurfaceIsFlat) {
  for (const double gap : {4.0, 9.0, 15.0}) {
    const auto result = square(
        20, [&](const Vec3& a, const Vec3& b) { return a.y() == 10 && b.y() == 10 && std::min(a.x(), b.x()) != gap; });
    const Segmentation found = segments_of(result);
    EXPECT_EQ(found.count, 2U);
    for (Index f = 0; f < result.mesh.triangles.size(); ++f) {
      Vec3 centre = Vec3::Zero();
      for (const Index v : result.mesh.triangles[f]) centre += result.mesh.positions[v] / 3;
      EXPECT_EQ(found.segments[f] == found.segments[0], centre.y() < 10);
    }
  }
}

TEST(Segmentation, StrayRidgesAndSpecksDoNotSplitSegments) {
  EXPECT_EQ(segments_of(square(20,
                               [](const Vec3& a, const Vec3& b) {
                                 return std::lround(a.x() * 7 + a.y() * 13 + b.x() * 5 + b.y()) % 29 == 0;
                               }))
                .count,
            1U);
  EXPECT_EQ(
      segments_of(square(20, [](const Vec3& a,
                                const Vec3& b) { return a.y() == 10 && b.y() == 10 && a.x() < 12 && b.x() < 12; }))
          .count,
      1U);
  LabelledMesh speck = square(20, [](const Vec3&, const Vec3&) { return false; });
  const Topology topology = build_topology(speck.mesh);
  for (const Index face : {301U, 444U, 445U}) {
    for (const Index e : topology.face_edges[face]) speck.labels[e] = 0.9;
  }
  EXPECT_EQ(segments_of(speck).count, 1U);
}

TEST(Segmentation, SegmentsEndAtNonManifoldEdges) {
  for (const auto& member : test::mesh_family()) {
    SCOPED_TRACE(member.name);
    const Topology topology = build_topology(member.mesh);
    std::vector<Index> whole(member.mesh.triangles.size(), 0);
    const std::vector<double> none(topology.edges.size(), 0);
    const SegmentField field(member.mesh, topology, member.mesh.positions, none, angles_of(member.mesh, topology));
    const Index parts = split_segments(field, whole);
    EXPECT_EQ(segment_faces(field).segments, whole);
    EXPECT_GE(parts, 1U);
  }
}

/// Features in a form that does not depend on numbering: classes by vertex, segments as sets of faces, lines as sets.
struct Unnumbered {
  std::vector<VertexClass> classes;
  std::set<std::set<Index>> segments;
  std::set<std::pair<bool, std::set<Index>>> lines;
  bool operator==(const Unnumbered&) const = default;
};

/// `vertex` and `face` map numbers to the names to use.
Unnumbered unnumbered(const Features& features, const std::vector<Index>& vertex, const std::vector<Index>& face) {
  Unnumbered result;
  result.classes.resize(vertex.size());
  for (Index v = 0; v < vertex.size(); ++v) result.classes[vertex[v]] = features.classes[v];
  std::map<Index, std::set<Index>> segments;
  for (Index f = 0; f < face.size(); ++f) segments[features.segments[f]].insert(face[f]);
  for (const auto& [number, faces] : segments) result.segments.insert(faces);
  for (const RidgeLine& line : features.ridge_lines) {
    std::set<Index> vertices;
    for (const Index v : line.vertices) vertices.insert(vertex[v]);
    result.lines.emplace(line.closed, vertices);
  }
  return result;
}

TEST(Features, ArePermutedWhenTheMeshIsRenumbered) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> shake(-0.02, 0.02), weak(0, 0.3), strong(0.6, 1);
  LabelledMesh part = labelled(test::cad_part(4).mesh);
  for (Vec3& position : part.mesh.positions) position += Vec3(shake(random), shake(random), shake(random));
  for (double& label : part.labels) label = label == 1 && random() % 12 != 0 ? strong(random) : weak(random);

  std::vector<Index> vertex(part.mesh.positions.size()), face(part.mesh.triangles.size());
  for (Index v = 0; v < vertex.size(); ++v) vertex[v] = v;
  for (Index f = 0; f < face.size(); ++f) face[f] = f;
  const Topology topology = build_topology(part.mesh);
  const Unnumbered expected =
      unnumbered(find_features(part.mesh, topology, part.mesh.positions, part.labels), vertex, face);
  std::map<std::pair<Index, Index>, double> label_of;
  for (std::size_t e = 0; e < part.edges.size(); ++e) label_of[{part.edges[e].v0, part.edges[e].v1}] = part.labels[e];

  for (int trial = 0; trial < 3; ++trial) {
    std::ranges::shuffle(vertex, random);
    std::ranges::shuffle(face, random);
    std::vector<Index> new_number(vertex.size());
    for (Index v = 0; v < vertex.size(); ++v) new_number[vertex[v]] = v;
    Mesh other;
    for (const Index v : vertex) other.positions.push_back(part.mesh.positions[v]);
    for (const Index f : face) {
      const auto [a, b, c] = part.mesh.triangles[f];
      other.triangles.push_back({new_number[b], new_number[c], new_number[a]});
    }
    const Topology other_topology = build_topology(other);
    std::vector<double> labels;
    for (const auto& [v0, v1] : other_topology.edges)
      labels.push_back(label_of.at(std::minmax(vertex[v0], vertex[v1])));
    const Features features = find_features(other, other_topology, other.positions, labels);
    EXPECT_EQ(unnumbered(features, vertex, face), expected);
  }
}

TEST(Segmentation, IsTheSameOnTwoThreads) {
  const LabelledMesh cube = labelled(add_noise(test::cube(24), 0.1, 1, NoiseKind::kGaussian));
  const Topology topology = build_topology(cube.mesh);
  ThreadTeam team(2);
  const Segmentation alone = segment_faces(cube.mesh, topology, cube.mesh.positions, cube.labels);
  const Segmentation together = segment_faces(cube.mesh, topology, cube.mesh.positions, cube.labels, {}, team);
  EXPECT_EQ(together.segments, alone.segments);
  EXPECT_EQ(together.energies, alone.energies);
}

TEST(Features, AreRightOnACube) {
  const LabelledMesh cube = labelled(test::cube(4));
  const Features features = find_features(cube.mesh, build_topology(cube.mesh), cube.mesh.positions, cube.labels);
  EXPECT_EQ(features.corners.size(), 8U);
  EXPECT_EQ(features.ridge_lines.size(), 12U);
  EXPECT_EQ(features.segment_count, 6U);
  for (const Index corner : features.corners) EXPECT_EQ(features.classes[corner], VertexClass::kCorner);
}

}  // namespace
}  // namespace crease
