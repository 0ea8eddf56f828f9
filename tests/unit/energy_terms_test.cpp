#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>
#include <set>

#include "core/energy/points.h"
#include "core/energy/smoothness.h"
#include "core/solve/edge_process.h"
#include "core/solve/vertex_process.h"
#include "tests/support/meshes.h"
#include "tests/support/smooth_support.h"

namespace crease {
namespace {

std::vector<double> some_weights(std::size_t count) {
  std::vector<double> weights;
  for (std::size_t v = 0; v < count; ++v) weights.push_back(0.5 + static_cast<double>(v % 5));
  return weights;
}

/// One option set for every term that a vertex's position takes part in.
std::vector<std::pair<std::string, MrfOptions>> variants() {
  std::vector<std::pair<std::string, MrfOptions>> all;
  const auto add = [&](std::string name, auto change) {
    MrfOptions options;
    options.likelihood_weight = 0.7;
    change(options);
    all.emplace_back(std::move(name), options);
  };
  for (const Smoothness shape :
       {Smoothness::kQuadratic, Smoothness::kSquareRoot, Smoothness::kHuber, Smoothness::kTruncated}) {
    add("smoothness " + std::to_string(static_cast<int>(shape)), [&](MrfOptions& o) { o.smoothness = shape; });
  }
  add("huber", [](MrfOptions& o) {
    o.likelihood = LikelihoodKind::kHuber;
    o.likelihood_width = 0.1;
  });
  add("along the vertex normal", [](MrfOptions& o) { o.likelihood = LikelihoodKind::kAnisotropic; });
  add("along z", [](MrfOptions& o) {
    o.likelihood = LikelihoodKind::kAnisotropic;
    o.scan_direction = {0, 0, 2};
  });
  add("volume", [](MrfOptions& o) { o.likelihood = LikelihoodKind::kVolume; });
  add("curvature", [](MrfOptions& o) { o.curvature_weight = 1.5; });
  add("ridge line", [](MrfOptions& o) { o.ridge_line_weight = 0.8; });
  return all;
}

/// The part of E that changes when a vertex moves and nothing else does.
double of_positions(const Energy& all) {
  return all.of<LikelihoodTerm>() + all.of<SmoothnessTerm>() + all.of<CurvatureTerm>() + all.of<RidgeLineTerm>();
}

TEST(EnergyTerms, AVertexProposalChangesTheFullEnergyByItsDelta) {
  for (const auto& [name, options] : variants()) {
    for (const auto& [mesh_name, mesh, manifold, closed, degenerate] : test::mesh_family()) {
      const Topology topology = build_topology(mesh);
      const Schedule schedule = schedule_vertices(mesh, topology, Neighborhood::kWide);
      const std::vector<double> weights = some_weights(mesh.positions.size());
      test::FieldWithEnergy state(test::shaken_field(mesh, topology, 3), options, weights);
      const Field& field = state.field;
      VertexProcess process(state.field, state.terms, schedule, 1);
      const double before = of_positions(state.energy());
      for (std::size_t slot = 0; slot < std::min<std::size_t>(schedule.sites.size(), 20); ++slot) {
        const Index vertex = schedule.sites[slot];
        const Vec3 old = field.positions[vertex];
        const double delta = process.delta_energy(slot, old + Vec3(0.09, -0.05, 0.06), state.weights());
        Field moved = field;
        moved.positions[vertex] = old + Vec3(0.09, -0.05, 0.06);
        EXPECT_NEAR(delta, of_positions(test::energy_of(moved, options, weights)) - before, 5e-5)
            << name << ", " << mesh_name << " vertex " << vertex;
      }
    }
  }
}

TEST(EnergyTerms, ALabelProposalChangesTheFullEnergyByItsDelta) {
  MrfOptions options;
  options.curvature_weight = 1.5;
  options.continuity_weight = 0.4;
  for (const auto& [name, mesh, manifold, closed, degenerate] : test::mesh_family()) {
    const Topology topology = build_topology(mesh);
    test::FieldWithEnergy state(test::shaken_field(mesh, topology, 3), options);
    EdgeProcess process(state.field, state.terms, state.weights());
    for (Index e = 0; e < std::min<std::size_t>(topology.edges.size(), 60); ++e) {
      if (!topology.is_interior(e)) continue;
      const double before = state.energy().total();
      const double delta = process.delta_energy(e, 0.25);
      process.set_label(e, 0.25);
      EXPECT_NEAR(delta, state.energy().total() - before, 1e-6) << name << " edge " << e;
    }
  }
}

TEST(EnergyTerms, VerticesOfARunDoNotSeeEachOtherInAnyTerm) {
  const Mesh mesh = test::icosphere(3);
  const Topology topology = build_topology(mesh);
  const Schedule schedule = schedule_vertices(mesh, topology, Neighborhood::kWide);
  for (const auto& [name, options] : variants()) {
    test::FieldWithEnergy state(test::shaken_field(mesh, topology, 3), options);
    const Field& field = state.field;
    VertexProcess process(state.field, state.terms, schedule, 1);
    const Vec3 step(0.05, 0.04, -0.07);
    for (std::size_t run = 0; run + 1 < schedule.runs.size(); run += 5) {
      if (schedule.runs[run + 1] - schedule.runs[run] < 2) continue;
      const std::size_t first = schedule.runs[run], second = first + 1;
      const double before =
          process.delta_energy(second, field.positions[schedule.sites[second]] + step, state.weights());
      test::FieldWithEnergy moved(field, options);
      moved.field.positions[schedule.sites[first]] += step;
      moved.update();
      VertexProcess after(moved.field, moved.terms, schedule, 1);
      const Vec3 to = moved.field.positions[schedule.sites[second]] + step;
      EXPECT_EQ(after.delta_energy(second, to, moved.weights()), before) << name;
    }
  }
}

TEST(Potential, HuberAndTruncatedLeaveTheQuadraticAtTheirWidth) {
  constexpr float kWidth = 0.5F;
  const auto rho = [](Smoothness shape, double x) { return potential(shape, x * x, kWidth).value; };
  for (const double x : {0.0, 0.1, 0.49}) {
    EXPECT_DOUBLE_EQ(rho(Smoothness::kHuber, x), x * x);
    EXPECT_DOUBLE_EQ(rho(Smoothness::kTruncated, x), x * x);
  }
  for (const double x : {0.5, 0.7, 2.0}) {
    EXPECT_DOUBLE_EQ(rho(Smoothness::kHuber, x), x - 0.25);
    EXPECT_DOUBLE_EQ(rho(Smoothness::kTruncated, x), 0.25);
    EXPECT_DOUBLE_EQ(rho(Smoothness::kSquareRoot, x), x);
  }
}

TEST(Potential, LanesAgreeWithSingleNumbers) {
  const Lanes squares{0, 0.01F, 0.2F, 0.25F, 0.3F, 1, 2, 4};
  for (const Smoothness shape :
       {Smoothness::kQuadratic, Smoothness::kSquareRoot, Smoothness::kHuber, Smoothness::kTruncated}) {
    const Lanes result =
        with_shape(shape, [&]<Smoothness kShape>() { return LaneVectors{potential<kShape>(squares, 0.5F).value}; }).x;
    for (std::size_t k = 0; k < 8; ++k) {
      EXPECT_FLOAT_EQ(result[k], static_cast<float>(potential(shape, double{squares[k]}, 0.5F).value));
    }
  }
}

TEST(Potential, SlopesEqualFiniteDifferences) {
  constexpr double kStep = 1e-6;
  for (const Smoothness shape :
       {Smoothness::kQuadratic, Smoothness::kSquareRoot, Smoothness::kHuber, Smoothness::kTruncated}) {
    for (const double square : {0.01, 0.2, 0.3, 1.7}) {
      const double above = potential(shape, square + kStep, 0.5F).value;
      const double below = potential(shape, square - kStep, 0.5F).value;
      EXPECT_NEAR(potential(shape, square, 0.5F).slope, (above - below) / (2 * kStep), 1e-7);
    }
  }
}

TEST(Likelihood, TellsTheDirectionOfTheScanner) {
  const Mesh mesh = test::grid(4, 4);
  const Topology topology = build_topology(mesh);
  MrfOptions options;
  options.likelihood = LikelihoodKind::kAnisotropic;
  options.likelihood_across = 10;
  for (const Vec3& direction : {Vec3(0, 0, 0), Vec3(0, 0, 3)}) {  // the vertex normal of a flat grid is z
    options.scan_direction = direction;
    Field field(mesh, topology);
    const LikelihoodTerm likelihood({field, options, {}});
    field.positions[5] += Vec3(0, 0, 0.2);
    EXPECT_NEAR(likelihood.at_positions(FieldPoints{field}, 5), 0.04, 1e-12);
    field.positions[5] = field.measured[5] + Vec3(0.2, 0, 0);
    EXPECT_NEAR(likelihood.at_positions(FieldPoints{field}, 5), 0.4, 1e-12);
  }
}

TEST(Likelihood, OfVolumeIsZeroWhereANeighbourhoodSweepsNone) {
  const Mesh mesh = test::grid(6, 6);
  const Topology topology = build_topology(mesh);
  MrfOptions options;
  options.likelihood = LikelihoodKind::kVolume;
  options.volume_weight = 100;
  Field field(mesh, topology);
  const LikelihoodTerm likelihood({field, options, {}});
  for (Vec3& position : field.positions) position += Vec3(0, 0, 0.1);
  EXPECT_NEAR(likelihood.at_positions(FieldPoints{field}, 14), 0.01 + 100 * 0.01, 1e-9);
  for (std::size_t v = 0; v < field.positions.size(); ++v) field.positions[v] = field.measured[v] + Vec3(0.1, 0, 0);
  EXPECT_NEAR(likelihood.at_positions(FieldPoints{field}, 14), 0.01, 1e-9);
}

// A cylinder's normals change linearly from face to face; the first-order prior sees a slope, the second none.
TEST(CurvatureTerm, OfALinearNormalFieldIsZero) {
  const Mesh mesh = test::grid(8, 8);
  const Topology topology = build_topology(mesh);
  Field field(mesh, topology);
  for (std::size_t f = 0; f < field.faces.size(); ++f) {
    Vec3 centroid = Vec3::Zero();
    for (const Index v : field.faces[f]) centroid += field.measured[v] / 3;
    field.normals[f] = {static_cast<float>(0.02 * centroid.x()), static_cast<float>(-0.01 * centroid.y()), 1, 0};
  }
  const CurvatureTerm curvature({field, {}, {}});
  for (Index f = 0; f < field.faces.size(); ++f) {
    EXPECT_NEAR(curvature.second_difference(FieldNormals{field}, f).squaredNorm(), 0, 1e-10);
  }
}

TEST(SharpnessTerm, ClampingTurnsTheAngleOfWhatMayBeNoRidge) {
  const Mesh mesh = test::icosphere(1);  // convex everywhere
  const Topology topology = build_topology(mesh);
  Field field(mesh, topology);
  ThreadTeam alone(1);
  field.update_edges(alone);
  const double convex = field.edges.angle[0];
  EXPECT_GT(convex, 0.1);
  MrfOptions options;
  const auto angle = [&] { return SharpnessTerm({field, options, {}}).angle(convex); };
  EXPECT_EQ(angle(), convex);
  options.ridge_kind = RidgeKind::kConvex;
  EXPECT_EQ(angle(), convex);
  options.ridge_kind = RidgeKind::kConcave;
  EXPECT_EQ(angle(), -convex);
  options.ridge_kind = RidgeKind::kAll;
  options.sharpness_limit = convex / 2;
  EXPECT_EQ(angle(), -convex);
}

TEST(EnergyTerms, EveryTermHasANameAndANumberOfItsOwn) {
  std::set<std::string_view> names{"total"};
  std::set<int> fields{kTotalField};
  for (const auto& [name, field] : kTermNames) {
    EXPECT_TRUE(names.insert(name).second) << name;
    EXPECT_TRUE(fields.insert(field).second) << name;
  }
}

// One end of the annealed weight may be 0; the term is there all the same.
TEST(EnergyTerms, ALikelihoodThatFadesToNothingCountsUntilThen) {
  MrfOptions options;
  options.likelihood_weight = 0;
  options.likelihood = LikelihoodKind::kVolume;
  EXPECT_EQ(EnergyTerms::neighborhood(options), Neighborhood::kWide);
  const Mesh mesh = test::grid(4, 4);
  const Topology topology = build_topology(mesh);
  test::FieldWithEnergy state(test::shaken_field(mesh, topology, 3), options);
  Weights weights = state.weights();
  weights.of<LikelihoodTerm>() = 1;
  EXPECT_GT(state.terms.energy(state.field, weights, state.alone).of<LikelihoodTerm>(), 0);
}

}  // namespace
}  // namespace crease
