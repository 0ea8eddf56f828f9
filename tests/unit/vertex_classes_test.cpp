#include "core/features/vertex_classes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>

#include "tests/support/labelled_meshes.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

using test::labelled;
using enum VertexClass;

constexpr std::array kClasses = {kSmooth, kRidge, kCorner};

std::vector<VertexClass> classes_of(const LabelledMesh& result) {
  return classify_vertices(build_topology(result.mesh), result.mesh.positions, result.labels);
}

std::map<VertexClass, int> counts(const std::vector<VertexClass>& classes) {
  std::map<VertexClass, int> result;
  for (const VertexClass c : classes) ++result[c];
  return result;
}

std::vector<VertexClass> random_classes(std::size_t count, std::mt19937& random) {
  std::vector<VertexClass> classes(count);
  for (VertexClass& c : classes) c = kClasses[std::uniform_int_distribution<std::size_t>(0, 2)(random)];
  return classes;
}

/// The energy as the header defines it, with default weights, from edges sorted by label.
class BruteForce {
 public:
  BruteForce(const Mesh& mesh, const Topology& topology, const std::vector<double>& labels)
      : mesh_(mesh), topology_(topology), labels_(labels) {}

  double operator()(const std::vector<VertexClass>& classes) const {
    double sum = 0;
    for (Index v = 0; v < classes.size(); ++v) sum += unary(v, classes[v]);
    for (Index e = 0; e < labels_.size(); ++e) {
      const VertexClass a = classes[topology_.edges[e].v0], b = classes[topology_.edges[e].v1];
      if (a == b || !topology_.is_interior(e)) continue;
      const double along = a == kSmooth || b == kSmooth ? 0.3 : 0.05;
      sum += labels_[e] * along + (1 - labels_[e]) * 0.03;
    }
    return sum;
  }

 private:
  double nth_label(Index v, std::size_t n) const { return sorted(v).size() > n ? labels_[sorted(v)[n]] : 0; }

  std::vector<Index> sorted(Index v) const {
    std::vector<Index> edges;
    for (const Index e : topology_.vertex_edges[v]) {
      if (labels_[e] > 0) edges.push_back(e);
    }
    std::ranges::stable_sort(edges, [&](Index a, Index b) { return labels_[a] > labels_[b]; });
    return edges;
  }

  Index other_end(Index e, Index v) const {
    return topology_.edges[e].v0 == v ? topology_.edges[e].v1 : topology_.edges[e].v0;
  }

  double straight(Index v, Index e, Index f) const {
    const Vec3 to_e = (mesh_.positions[other_end(e, v)] - mesh_.positions[v]).stableNormalized();
    const Vec3 to_f = (mesh_.positions[other_end(f, v)] - mesh_.positions[v]).stableNormalized();
    const double turn_deg = std::acos(std::clamp(-to_e.dot(to_f), -1.0, 1.0)) * 180 / M_PI;
    return turn_deg < 55 ? 1 : turn_deg > 85 ? 0 : (85 - turn_deg) / 30;
  }

  double unary(Index v, VertexClass c) const {
    const std::vector<Index> edges = sorted(v);
    const double r1 = nth_label(v, 0), r2 = nth_label(v, 1), r3 = nth_label(v, 2);
    const double beyond = edges.empty() ? 0 : nth_label(other_end(edges[0], v), 1);
    if (c == kSmooth) return std::max(r2, std::min(r1, beyond));
    if (c == kCorner) {
      const double turn = edges.size() > 1 ? r2 * (1 - straight(v, edges[0], edges[1])) : 0;
      return 1 - std::max({r3, turn, std::min({r1, 1 - r2, beyond})});
    }
    double best = 0;
    for (std::size_t i = 0; i < std::min<std::size_t>(edges.size(), 3); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        best = std::max(best, std::min(labels_[edges[i]], labels_[edges[j]]) * straight(v, edges[i], edges[j]));
      }
    }
    return std::max(1 - best, r3);
  }

  const Mesh& mesh_;
  const Topology& topology_;
  const std::vector<double>& labels_;
};

TEST(VertexClasses, EnergyAgreesWithItsDefinitionAndDeltasAreDifferences) {
  std::mt19937 random(1);
  for (const auto& member : test::mesh_family()) {
    SCOPED_TRACE(member.name);
    const Topology topology = build_topology(member.mesh);
    const std::vector<double> labels = test::random_labels(topology, random);
    const VertexClassField field(topology, member.mesh.positions, labels);
    std::vector<VertexClass> classes = random_classes(member.mesh.positions.size(), random);
    EXPECT_NEAR(field.energy(classes), BruteForce(member.mesh, topology, labels)(classes), 1e-7);
    for (Index v = 0; v < std::min<std::size_t>(classes.size(), 40); ++v) {
      for (const VertexClass c : kClasses) {
        const double before = field.energy(classes), delta = field.delta_energy(classes, v, c);
        std::vector<VertexClass> changed = classes;
        changed[v] = c;
        EXPECT_NEAR(delta, field.energy(changed) - before, 1e-9);
      }
    }
  }
}

TEST(VertexClasses, NoExpansionLowersTheEnergyFurther) {
  const Mesh mesh = test::grid(2, 2);
  const Topology topology = build_topology(mesh);
  const auto vertices = static_cast<unsigned>(mesh.positions.size());
  std::mt19937 random(2);
  for (int trial = 0; trial < 60; ++trial) {
    const std::vector<double> labels = test::random_labels(topology, random);
    VertexClassOptions options;
    options.along_weight = 0.2 * (1 + trial % 5);
    options.across_weight = 0.15 * (1 + trial % 3);
    const VertexClassField field(topology, mesh.positions, labels, options);
    const std::vector<VertexClass> classes = classify_vertices(field);
    const double energy = field.energy(classes);
    for (const VertexClass alpha : kClasses) {
      for (unsigned set = 0; set < 1U << vertices; ++set) {
        std::vector<VertexClass> moved = classes;
        for (unsigned v = 0; v < vertices; ++v) {
          if ((set >> v & 1U) != 0) moved[v] = alpha;
        }
        ASSERT_GE(field.energy(moved), energy - 1e-8);
      }
    }
  }
}

TEST(VertexClasses, AreOptimalOnATetrahedron) {
  const Mesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};
  const Topology topology = build_topology(mesh);
  std::mt19937 random(3);
  for (int trial = 0; trial < 200; ++trial) {
    const std::vector<double> labels = test::random_labels(topology, random);
    const VertexClassField field(topology, mesh.positions, labels);
    double best = 1e9;
    for (unsigned code = 0; code < 81; ++code) {
      best = std::min(best, field.energy(std::array{kClasses[code % 3], kClasses[code / 3 % 3], kClasses[code / 9 % 3],
                                                    kClasses[code / 27]}));
    }
    EXPECT_NEAR(field.energy(classify_vertices(field)), best, 1e-8);
  }
}

TEST(VertexClasses, AreRightOnACube) {
  const int per_side = 5;
  const auto classes = classes_of(labelled(test::cube(per_side)));
  EXPECT_EQ(counts(classes), (std::map<VertexClass, int>{{kSmooth, 6 * 16}, {kRidge, 12 * 4}, {kCorner, 8}}));
  EXPECT_EQ(counts(classes_of(labelled(test::cube(1)))), (std::map<VertexClass, int>{{kCorner, 8}}));
}

TEST(VertexClasses, AreRightOnACylinderAndASphere) {
  const auto cylinder = counts(classes_of(labelled(test::cylinder(24, 6, 1, 2))));
  EXPECT_EQ(cylinder.at(kRidge), 48);
  EXPECT_FALSE(cylinder.contains(kCorner));
  EXPECT_EQ(counts(classes_of(labelled(test::icosphere(3)))).size(), 1U);
}

TEST(VertexClasses, ARidgeEndsInACornerButAStrayEdgeDoesNot) {
  LabelledMesh result = labelled(test::grid(12, 12));
  const auto label = [&](const std::vector<Vec3>& path) {
    std::ranges::fill(result.labels, 0.02);
    for (std::size_t e = 0; e < result.edges.size(); ++e) {
      const Vec3 &a = result.mesh.positions[result.edges[e].v0], &b = result.mesh.positions[result.edges[e].v1];
      for (std::size_t i = 0; i + 1 < path.size(); ++i) {
        if ((a == path[i] && b == path[i + 1]) || (b == path[i] && a == path[i + 1])) result.labels[e] = 0.9;
      }
    }
    return counts(classes_of(result));
  };
  EXPECT_EQ(label({{3, 3, 0}, {4, 3, 0}}).size(), 1U);
  const auto straight = label({{3, 3, 0}, {4, 3, 0}, {5, 3, 0}, {6, 3, 0}});
  EXPECT_EQ(straight.at(kCorner), 2);
  EXPECT_EQ(straight.at(kRidge), 2);
  const auto bent = label({{3, 3, 0}, {4, 3, 0}, {5, 3, 0}, {5, 4, 0}, {5, 5, 0}});
  EXPECT_EQ(bent.at(kCorner), 3);
  EXPECT_EQ(bent.at(kRidge), 2);
  const auto to_boundary = label({{0, 6, 0}, {1, 6, 0}, {2, 6, 0}, {3, 6, 0}});
  EXPECT_EQ(to_boundary.at(kCorner), 2);
  EXPECT_EQ(to_boundary.at(kRidge), 2);
}

TEST(VertexClasses, AWeakLinkDoesNotBreakARidge) {
  LabelledMesh cube = labelled(test::cube(6));
  const auto strong = classes_of(cube);
  for (std::size_t e = 0; e < cube.labels.size(); e += 7) {
    if (cube.labels[e] == 1) cube.labels[e] = 0.55;
  }
  EXPECT_EQ(classes_of(cube), strong);
}

}  // namespace
}  // namespace crease
