#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "core/smooth/edge_process.h"
#include "core/smooth/potential.h"
#include "core/smooth/vertex_process.h"
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

double energy_of_positions(const Field& field, const EnergyModel& model) {
  const Energy all = energy(field, model);
  return all.likelihood + all.smoothness + all.curvature + all.ridge_line;
}

TEST(EnergyTerms, AVertexProposalChangesTheFullEnergyByItsDelta) {
  for (const auto& [name, options] : variants()) {
    const EnergyModel model = EnergyModel::final_of(options);
    for (const auto& [mesh_name, mesh, manifold, closed, degenerate] : test::mesh_family()) {
      const Topology topology = build_topology(mesh);
      const Schedule schedule = schedule_vertices(mesh, topology, Neighborhood::kWide);
      Field field = test::shaken_field(mesh, topology, 3, options, some_weights(mesh.positions.size()));
      ThreadTeam alone(1);
      VertexProcess process(field, schedule, 1);
      process.set_model(model, alone);
      const double before = energy_of_positions(field, model);
      for (std::size_t slot = 0; slot < std::min<std::size_t>(schedule.sites.size(), 20); ++slot) {
        const Index vertex = schedule.sites[slot];
        const Vec3 old = field.positions[vertex];
        const double delta = process.delta_energy(slot, old + Vec3(0.09, -0.05, 0.06));
        Field moved = field;
        moved.positions[vertex] = old + Vec3(0.09, -0.05, 0.06);
        moved.update_normals(alone);
        EXPECT_NEAR(delta, energy_of_positions(moved, model) - before, 5e-5)
            << name << ", " << mesh_name << " vertex " << vertex;
      }
    }
  }
}

TEST(EnergyTerms, ALabelProposalChangesTheFullEnergyByItsDelta) {
  MrfOptions options;
  options.curvature_weight = 1.5;
  options.continuity_weight = 0.4;
  const EnergyModel model = EnergyModel::final_of(options);
  for (const auto& [name, mesh, manifold, closed, degenerate] : test::mesh_family()) {
    const Topology topology = build_topology(mesh);
    Field field = test::shaken_field(mesh, topology, 3, options);
    ThreadTeam alone(1);
    EdgeTerms terms;
    terms.update(field, model, alone);
    EdgeProcess process(field, terms, model);
    for (Index e = 0; e < std::min<std::size_t>(topology.edges.size(), 60); ++e) {
      if (!topology.is_interior(e)) continue;
      const double before = energy(field, model).total();
      const double delta = process.delta_energy(e, 0.25);
      process.set_label(e, 0.25);
      EXPECT_NEAR(delta, energy(field, model).total() - before, 1e-6) << name << " edge " << e;
    }
  }
}

TEST(EnergyTerms, VerticesOfARunDoNotSeeEachOtherInAnyTerm) {
  const Mesh mesh = test::icosphere(3);
  const Topology topology = build_topology(mesh);
  const Schedule schedule = schedule_vertices(mesh, topology, Neighborhood::kWide);
  for (const auto& [name, options] : variants()) {
    const EnergyModel model = EnergyModel::final_of(options);
    Field field = test::shaken_field(mesh, topology, 3, options);
    ThreadTeam alone(1);
    VertexProcess process(field, schedule, 1);
    process.set_model(model, alone);
    const Vec3 step(0.05, 0.04, -0.07);
    for (std::size_t run = 0; run + 1 < schedule.runs.size(); run += 5) {
      if (schedule.runs[run + 1] - schedule.runs[run] < 2) continue;
      const std::size_t first = schedule.runs[run], second = first + 1;
      const double before = process.delta_energy(second, field.positions[schedule.sites[second]] + step);
      Field moved = field;
      moved.positions[schedule.sites[first]] += step;
      moved.update_normals(alone);
      VertexProcess after(moved, schedule, 1);
      after.set_model(model, alone);
      EXPECT_EQ(after.delta_energy(second, moved.positions[schedule.sites[second]] + step), before) << name;
    }
  }
}

TEST(Potential, HuberAndTruncatedLeaveTheQuadraticAtTheirWidth) {
  constexpr float kWidth = 0.5F;
  const auto rho = [](Smoothness shape, double x) { return smoothness_potential(shape, x * x, kWidth); };
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
    const Lanes result = with_shape(shape, [&]<Smoothness kShape>() {
                           return LaneVectors{smoothness_potential<kShape>(squares, 0.5F)};
                         }).x;
    for (std::size_t k = 0; k < 8; ++k) {
      EXPECT_FLOAT_EQ(result[k], static_cast<float>(smoothness_potential(shape, double{squares[k]}, 0.5F)));
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
    Field field(mesh, topology, options);
    field.positions[5] += Vec3(0, 0, 0.2);
    EXPECT_NEAR(field.likelihood.energy(field, 5), 0.04, 1e-12);
    field.positions[5] = field.measured[5] + Vec3(0.2, 0, 0);
    EXPECT_NEAR(field.likelihood.energy(field, 5), 0.4, 1e-12);
  }
}

TEST(Likelihood, OfVolumeIsZeroWhereANeighbourhoodSweepsNone) {
  const Mesh mesh = test::grid(6, 6);
  const Topology topology = build_topology(mesh);
  MrfOptions options;
  options.likelihood = LikelihoodKind::kVolume;
  options.volume_weight = 100;
  Field field(mesh, topology, options);
  for (Vec3& position : field.positions) position += Vec3(0, 0, 0.1);
  EXPECT_NEAR(field.likelihood.energy(field, 14), 0.01 + 100 * 0.01, 1e-9);
  for (std::size_t v = 0; v < field.positions.size(); ++v) field.positions[v] = field.measured[v] + Vec3(0.1, 0, 0);
  EXPECT_NEAR(field.likelihood.energy(field, 14), 0.01, 1e-9);
}

// A cylinder's normals change linearly from face to face; the first-order prior sees a slope, the second none.
TEST(SecondDifference, OfALinearNormalFieldIsZero) {
  const Mesh mesh = test::grid(8, 8);
  const Topology topology = build_topology(mesh);
  Field field(mesh, topology);
  for (std::size_t f = 0; f < field.faces.size(); ++f) {
    Vec3 centroid = Vec3::Zero();
    for (const Index v : field.faces[f]) centroid += field.measured[v] / 3;
    field.normals[f] = {static_cast<float>(0.02 * centroid.x()), static_cast<float>(-0.01 * centroid.y()), 1, 0};
  }
  for (Index f = 0; f < field.faces.size(); ++f) EXPECT_NEAR(field.second_difference.square(field, f), 0, 1e-10);
}

TEST(EdgeTerms, ClampingTurnsTheAngleOfWhatMayBeNoRidge) {
  const Mesh mesh = test::icosphere(1);  // convex everywhere
  const Topology topology = build_topology(mesh);
  const Field field(mesh, topology);
  ThreadTeam alone(1);
  EdgeTerms terms;
  MrfOptions options;
  const auto angle = [&] {
    terms.update(field, EnergyModel::final_of(options), alone);
    return terms.angle[0];
  };
  const double convex = angle();
  EXPECT_GT(convex, 0.1);
  EXPECT_NEAR(terms.dihedral[0], convex, 1e-12);
  options.ridge_kind = RidgeKind::kConvex;
  EXPECT_EQ(angle(), convex);
  options.ridge_kind = RidgeKind::kConcave;
  EXPECT_EQ(angle(), -convex);
  options.ridge_kind = RidgeKind::kAll;
  options.sharpness_limit = convex / 2;
  EXPECT_EQ(angle(), -convex);
}

}  // namespace
}  // namespace crease
