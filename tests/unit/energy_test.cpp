#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <map>
#include <numbers>
#include <random>

#include "core/energy/field.h"
#include "core/solve/edge_process.h"
#include "core/solve/vertex_process.h"
#include "tests/support/meshes.h"
#include "tests/support/smooth_support.h"

namespace crease {
namespace {

using test::mesh_family;

MrfOptions with(Smoothness smoothness) {
  MrfOptions options;
  options.likelihood_weight = 0.7;
  options.smoothness_weight = 1.3;
  options.sharpness_weight = 0.9;
  options.sharpness_threshold = 0.5;
  options.support_weight = 0.6;
  options.smoothness = smoothness;
  return options;
}

const MrfOptions kOptions = with(Smoothness::kQuadratic);

double angle_between(const Vec3& a, const Vec3& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

/// Unit, in double precision; zero for a face without area.
Vec3 exact_normal(const Field& field, Index face) {
  const auto [a, b, c] = field.faces[face];
  const Vec3 cross = (field.positions[b] - field.positions[a]).cross(field.positions[c] - field.positions[a]);
  return cross.norm() > 1e-13 ? Vec3(cross.normalized()) : Vec3::Zero();
}

/// E(v, ε) written down as DESIGN's formula has it, pair by pair.
Energy brute_force(const Field& field, const MrfOptions& options) {
  const Topology& topology = field.topology;
  Energy sum;
  for (std::size_t v = 0; v < field.positions.size(); ++v) {
    sum.of<LikelihoodTerm>() += options.likelihood_weight * (field.positions[v] - field.measured[v]).squaredNorm();
  }
  for (std::size_t e = 0; e < topology.edges.size(); ++e) {
    if (!topology.is_interior(e)) continue;
    const Vec3 n0 = exact_normal(field, topology.edge_faces[e][0]), n1 = exact_normal(field, topology.edge_faces[e][1]);
    const double difference = (n0 - n1).norm();
    const double rho = options.smoothness == Smoothness::kQuadratic ? difference * difference : difference;
    const double angle = n0.isZero(0) || n1.isZero(0) ? 0 : angle_between(n0, n1);
    sum.of<SmoothnessTerm>() += options.smoothness_weight * (1 - field.labels[e]) * rho;
    sum.of<SharpnessTerm>() += options.sharpness_weight * (options.sharpness_threshold - angle) * field.labels[e];
  }
  for (Index v = 0; v < field.positions.size(); ++v) {
    const auto edges = topology.vertex_edges[v];
    const auto outward = [&](Index e) {
      const Edge& edge = topology.edges[e];
      return Vec3((field.positions[edge.v0 == v ? edge.v1 : edge.v0] - field.positions[v]).stableNormalized());
    };
    for (std::size_t i = 0; i < edges.size(); ++i) {
      for (std::size_t j = i + 1; j < edges.size(); ++j) {
        const double cos_turning = -outward(edges[i]).dot(outward(edges[j]));
        sum.of<SupportTerm>() -= options.sharpness_weight * options.support_weight * cos_turning *
                                 field.labels[edges[i]] * field.labels[edges[j]];
      }
    }
  }
  return sum;
}

TEST(Energy, EveryTermAgreesWithItsDefinitionPairByPair) {
  for (const auto& [name, mesh, manifold, closed, degenerate] : mesh_family()) {
    const Topology topology = build_topology(mesh);
    const Field field = test::shaken_field(mesh, topology, 3);
    for (const Smoothness smoothness : {Smoothness::kQuadratic, Smoothness::kSquareRoot}) {
      const Energy actual = test::energy_of(field, with(smoothness)), expected = brute_force(field, with(smoothness));
      const double tolerance = 1e-7 * static_cast<double>(topology.edges.size() + 1);
      EXPECT_NEAR(actual.of<LikelihoodTerm>(), expected.of<LikelihoodTerm>(), tolerance) << name;
      EXPECT_NEAR(actual.of<SmoothnessTerm>(), expected.of<SmoothnessTerm>(), tolerance) << name;
      EXPECT_NEAR(actual.of<SharpnessTerm>(), expected.of<SharpnessTerm>(), tolerance) << name;
      EXPECT_NEAR(actual.of<SupportTerm>(), expected.of<SupportTerm>(), tolerance) << name;
    }
  }
}

TEST(Energy, OfALabelProposalIsTheDifferenceOfTheFullEnergies) {
  for (const auto& [name, mesh, manifold, closed, degenerate] : mesh_family()) {
    const Topology topology = build_topology(mesh);
    test::FieldWithEnergy state(test::shaken_field(mesh, topology, 5), kOptions);
    const Field& field = state.field;
    EdgeProcess process(state.field, state.terms, state.weights());
    for (Index e = 0; e < topology.edges.size(); ++e) {
      if (!topology.is_interior(e)) continue;
      const double before = brute_force(field, kOptions).total();
      const double wanted = e % 3 == 0 ? 0.0 : e % 3 == 1 ? 1.0 : 0.37;
      const double delta = process.delta_energy(e, wanted);
      process.set_label(e, wanted);
      EXPECT_NEAR(delta, brute_force(field, kOptions).total() - before, 1e-6) << name << " edge " << e;
      if (e > 60) break;
    }
  }
}

TEST(Energy, OfAVertexProposalIsTheDifferenceOfTheFullEnergies) {
  for (const auto& [name, mesh, manifold, closed, degenerate] : mesh_family()) {
    const Topology topology = build_topology(mesh);
    const Schedule schedule = schedule_vertices(mesh, topology);
    for (const Smoothness smoothness : {Smoothness::kQuadratic, Smoothness::kSquareRoot}) {
      const MrfOptions options = with(smoothness);
      test::FieldWithEnergy state(test::shaken_field(mesh, topology, 7), options);
      Field& field = state.field;
      VertexProcess process(field, state.terms, schedule, 1);
      const Energy before = brute_force(field, options);
      for (std::size_t slot = 0; slot < std::min<std::size_t>(schedule.sites.size(), 60); ++slot) {
        const Index vertex = schedule.sites[slot];
        const Vec3 old = field.positions[vertex];
        const Vec3 proposed = old + Vec3(0.11, -0.07, 0.05);
        const double delta = process.delta_energy(slot, proposed, state.weights());
        field.positions[vertex] = proposed;
        const Energy after = brute_force(field, options);
        field.positions[vertex] = old;
        // The support depends on edge directions, which the vertex process leaves to the edge process (§3.5).
        EXPECT_NEAR(delta,
                    after.of<LikelihoodTerm>() + after.of<SmoothnessTerm>() - before.of<LikelihoodTerm>() -
                        before.of<SmoothnessTerm>(),
                    2e-5)
            << name << " vertex " << vertex;
      }
    }
  }
}

TEST(Energy, IsTheSameWhenTheMeshIsMovedTurnedAndScaled) {
  for (const auto& [name, mesh, manifold, closed, degenerate] : mesh_family()) {
    const Topology topology = build_topology(mesh);
    const Field field = test::shaken_field(mesh, topology, 11);
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.8, Vec3(1, 2, 3).normalized()).toRotationMatrix();
    Mesh moved = mesh;
    for (Vec3& position : moved.positions) position = 2.5 * (turn * position) + field.unit * Vec3(10, -4, 3);
    Field same(moved, topology);
    same.labels = field.labels;
    for (std::size_t v = 0; v < same.positions.size(); ++v) {
      same.positions[v] = same.measured[v] + turn * (field.positions[v] - field.measured[v]);
    }
    EXPECT_NEAR(test::energy_of(same, kOptions).total(), test::energy_of(field, kOptions).total(), 1e-5) << name;
  }
}

TEST(Energy, IsTheSameWhenVerticesAndFacesAreRenumbered) {
  const Mesh mesh = test::icosphere(2);
  const Topology topology = build_topology(mesh);
  const Field field = test::shaken_field(mesh, topology, 13);
  const auto count = static_cast<Index>(mesh.positions.size());
  Mesh renumbered;
  for (Index v = 0; v < count; ++v) renumbered.positions.push_back(mesh.positions[count - 1 - v]);
  for (auto t = mesh.triangles.rbegin(); t != mesh.triangles.rend(); ++t) {
    renumbered.triangles.push_back({count - 1 - (*t)[1], count - 1 - (*t)[2], count - 1 - (*t)[0]});
  }
  const Topology other = build_topology(renumbered);
  Field same(renumbered, other);
  for (Index v = 0; v < count; ++v) {
    same.positions[v] = same.measured[v] + field.positions[count - 1 - v] - field.measured[count - 1 - v];
  }
  std::map<std::pair<Index, Index>, double> labels;
  for (std::size_t e = 0; e < topology.edges.size(); ++e) {
    labels[{count - 1 - topology.edges[e].v1, count - 1 - topology.edges[e].v0}] = field.labels[e];
  }
  for (std::size_t e = 0; e < other.edges.size(); ++e)
    same.labels[e] = labels.at({other.edges[e].v0, other.edges[e].v1});
  EXPECT_NEAR(test::energy_of(same, kOptions).total(), test::energy_of(field, kOptions).total(), 1e-6);
}

TEST(Energy, ThreadsDoNotChangeABit) {
  const Mesh mesh = test::icosphere(5);
  const Topology topology = build_topology(mesh);
  test::FieldWithEnergy state(test::shaken_field(mesh, topology, 17), kOptions);
  std::vector<double> totals;
  for (const std::uint32_t threads : {1U, 2U, 3U}) {
    ThreadTeam team(threads);
    state.field.update_edges(team);
    state.terms.positions_changed(state.field, team);
    totals.push_back(state.terms.energy(state.field, state.weights(), team).total());
  }
  EXPECT_EQ(totals[0], totals[1]);
  EXPECT_EQ(totals[0], totals[2]);
}

TEST(Energy, OfAPlaneIsZeroAndNoMoveOutOfItGoesDownhill) {
  const Mesh mesh = test::grid(6, 5);
  const Topology topology = build_topology(mesh);
  test::FieldWithEnergy state(Field(mesh, topology), kOptions);
  EXPECT_NEAR(state.energy().total(), 0, 1e-12);
  const Schedule schedule = schedule_vertices(mesh, topology);
  VertexProcess process(state.field, state.terms, schedule, 1);
  for (std::size_t slot = 0; slot < schedule.sites.size(); ++slot) {
    const Vec3& here = state.field.positions[schedule.sites[slot]];
    for (const double height : {-0.2, -0.01, 0.01, 0.2}) {
      EXPECT_GT(process.delta_energy(slot, here + Vec3(0, 0, height), state.weights()), 0);
    }
  }
}

TEST(Energy, StraightRidgesSupportAndHairpinsDiscourageEachOther) {
  const Mesh mesh = test::grid(3, 3);
  const Topology topology = build_topology(mesh);
  Field field(mesh, topology);
  MrfOptions options = kOptions;
  options.smoothness_weight = 0;
  const auto slope_of = [&](Index e, std::initializer_list<Index> labelled) {
    std::fill(field.labels.begin(), field.labels.end(), 0.0);
    for (const Index other : labelled) field.labels[other] = 1;
    test::FieldWithEnergy state(field, options);
    return EdgeProcess(state.field, state.terms, state.weights()).slope(e);
  };
  for (Index e = 0; e < topology.edges.size(); ++e) {
    if (!topology.is_interior(e)) continue;
    const double alone_slope = slope_of(e, {});
    EXPECT_NEAR(alone_slope, options.sharpness_weight * options.sharpness_threshold, 1e-7);
    for (const Index v : {topology.edges[e].v0, topology.edges[e].v1}) {
      for (const Index other : topology.vertex_edges[v]) {
        if (other == e || !topology.is_interior(other)) continue;
        const auto outward = [&](Index edge) {
          const Edge& x = topology.edges[edge];
          return Vec3((field.positions[x.v0 == v ? x.v1 : x.v0] - field.positions[v]).normalized());
        };
        const double cos_turning = -outward(e).dot(outward(other));
        EXPECT_NEAR(slope_of(e, {other}) - alone_slope,
                    -options.sharpness_weight * options.support_weight * cos_turning, 1e-12);
      }
    }
  }
}

}  // namespace
}  // namespace crease
