#include "core/smooth/face_process.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "core/measure/measure.h"
#include "core/measure/noise.h"
#include "core/smooth/smooth.h"
#include "core/smooth/vertex_descent.h"
#include "core/smooth/vertex_fit.h"
#include "tests/support/meshes.h"
#include "tests/support/smooth_support.h"

namespace crease {
namespace {

EnergyModel model_with(Smoothness shape) {
  MrfOptions options;
  options.smoothness = shape;
  options.smoothness_weight = 1.3;
  return EnergyModel::final_of(options);
}

TEST(FaceProcess, ANormalsDeltaIsTheDifferenceOfTheFullEnergies) {
  for (const auto& [name, mesh, manifold, closed, degenerate] : test::mesh_family()) {
    for (const Smoothness shape : {Smoothness::kQuadratic, Smoothness::kSquareRoot, Smoothness::kTruncated}) {
      const Topology topology = build_topology(mesh);
      Field field = test::shaken_field(mesh, topology, 5);
      ThreadTeam alone(1);
      FaceProcess process(field, 0.4, 0.6);
      process.measure(alone);
      process.set_model(model_with(shape), alone);
      const auto total = [&] { return process.likelihood(alone) + process.smoothness(alone); };
      for (Index face = 0; face < std::min<std::size_t>(mesh.triangles.size(), 40); ++face) {
        const UnitNormal proposed = (field.normals[face] + UnitNormal(0.2F, -0.1F, 0.15F, 0)).normalized();
        const double before = total();
        const double delta = process.delta_energy(face, proposed);
        field.normals[face] = proposed;
        EXPECT_NEAR(delta, total() - before, 2e-5) << name << " face " << face;
      }
    }
  }
}

TEST(FaceProcess, MeanFieldNeverRaisesTheEnergy) {
  const Mesh mesh = add_noise(test::icosphere(3), 0.2, 1, NoiseKind::kGaussian);
  const Topology topology = build_topology(mesh);
  const Schedule schedule = schedule_faces(mesh);
  for (const Smoothness shape : {Smoothness::kQuadratic, Smoothness::kHuber, Smoothness::kTruncated}) {
    Field field = test::shaken_field(mesh, topology, 5);
    ThreadTeam alone(1);
    FaceProcess process(field, 0.4, 0.6);
    process.measure(alone);
    process.set_model(model_with(shape), alone);
    double energy = process.likelihood(alone) + process.smoothness(alone);
    for (int pass = 0; pass < 10; ++pass) {
      process.relax(schedule, alone);
      const double after = process.likelihood(alone) + process.smoothness(alone);
      EXPECT_LE(after, energy + 1e-4);
      energy = after;
    }
  }
}

TEST(FaceProcess, FacesAcrossACornerAreCoupledByTheBetterWayRound) {
  const Mesh mesh = test::icosphere(0);  // five faces round every vertex
  const Topology topology = build_topology(mesh);
  ThreadTeam alone(1);
  const auto smoothness = [&](double all, Index cut) {
    Field field(mesh, topology);
    std::ranges::fill(field.labels, all);
    if (cut != kNone) field.labels[cut] = 1;
    FaceProcess process(field, 0, 1);
    process.measure(alone);
    process.set_model(model_with(Smoothness::kQuadratic), alone);
    return process.smoothness(alone);
  };
  // With every label at 1/2 neighbours weigh 1/2 and faces two apart 1/4 (the way round over three edges weighs 1/8).
  const Field field(mesh, topology);
  double near = 0, apart = 0;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    for (std::size_t g = f + 1; g < mesh.triangles.size(); ++g) {
      int shared = 0;
      for (const Index v : mesh.triangles[f]) shared += static_cast<int>(std::ranges::count(mesh.triangles[g], v));
      const auto square = static_cast<double>((field.normals[f] - field.normals[g]).squaredNorm());
      if (shared == 2) near += square;
      if (shared == 1) apart += square;
    }
  }
  EXPECT_NEAR(smoothness(0, kNone), 1.3 * (near + apart), 1e-4);
  EXPECT_NEAR(smoothness(0.5, kNone), 1.3 * (near / 2 + apart / 4), 1e-4);
  EXPECT_NEAR(smoothness(1, kNone), 0, 1e-9);
  // One cut edge: its two faces lose each other, all other pairs have a way round.
  const auto [f0, f1] = topology.edge_faces[0];
  const auto lost = static_cast<double>((field.normals[f0] - field.normals[f1]).squaredNorm());
  EXPECT_NEAR(smoothness(0, 0), 1.3 * (near + apart - lost), 1e-4);
}

TEST(VertexFit, FindsTheMeshOfExactNormals) {
  const Mesh original = test::icosphere(4);
  const Mesh noisy = add_noise(original, 0.15, 1, NoiseKind::kNormal);
  const Topology topology = build_topology(original);
  Field field(noisy, topology);
  field.normals = Field(original, topology).normals;
  ThreadTeam alone(1);
  fit_vertices(field, 100, alone);
  Mesh fitted = noisy;
  fitted.positions = field.upload_positions(noisy);
  EXPECT_LT(measure(original, fitted).mean_normal_error_deg, 0.1 * measure(original, noisy).mean_normal_error_deg);
}

TEST(VertexEnergy, ItsGradientEqualsFiniteDifferences) {
  std::vector<MrfOptions> variants(8);
  variants[1].smoothness = Smoothness::kSquareRoot;
  variants[2].smoothness = Smoothness::kHuber;
  variants[3].likelihood = LikelihoodKind::kHuber;
  variants[3].likelihood_width = 0.05;
  variants[4].likelihood = LikelihoodKind::kAnisotropic;
  variants[5].likelihood = LikelihoodKind::kVolume;
  variants[6].curvature_weight = 0.9;
  variants[7].ridge_line_weight = 0.7;
  for (std::size_t i = 0; i < variants.size(); ++i) {
    variants[i].likelihood_weight = 0.8;
    for (const Mesh& mesh : {test::icosphere(2), test::grid(5, 4)}) {
      const Topology topology = build_topology(mesh);
      Field field = test::shaken_field(mesh, topology, 5, variants[i]);
      ThreadTeam alone(1);
      VertexEnergy energy(field);
      energy.set_model(EnergyModel::final_of(variants[i]), alone);
      energy.value(alone);
      std::vector<Vec3> gradient;
      energy.gradient(gradient, alone);
      constexpr double kStep = 1e-5;
      for (std::size_t v = 0; v < field.positions.size(); v += 3) {
        for (Eigen::Index axis = 0; axis < 3; ++axis) {
          const double here = field.positions[v][axis];
          field.positions[v][axis] = here + kStep;
          const double above = energy.value(alone);
          field.positions[v][axis] = here - kStep;
          const double below = energy.value(alone);
          field.positions[v][axis] = here;
          EXPECT_NEAR(gradient[v][axis], (above - below) / (2 * kStep), 1e-4 * (1 + std::abs(gradient[v][axis])))
              << "variant " << i << " vertex " << v;
        }
      }
    }
  }
}

TEST(VertexDescent, LowersTheEnergyStepByStep) {
  const Mesh mesh = add_noise(test::icosphere(3), 0.3, 1, NoiseKind::kGaussian);
  const Topology topology = build_topology(mesh);
  MrfOptions options;
  Field field(mesh, topology, options);
  ThreadTeam alone(1);
  VertexDescent descent(field);
  VertexEnergy energy(field);
  const EnergyModel model = EnergyModel::final_of(options);
  energy.set_model(model, alone);
  double last = energy.value(alone);
  const double first = last;
  for (int step = 0; step < 30; ++step) {
    descent.run(model, alone);
    const double now = energy.value(alone);
    EXPECT_LE(now, last);
    last = now;
  }
  EXPECT_LT(last, 0.1 * first);
}

// The paper's Fig. 6.
TEST(Process, EachSmoothsANoisyCubeAndFindsItsRidges) {
  const Mesh original = test::cube(10);
  const Mesh noisy = add_noise(original, 0.2, 1, NoiseKind::kGaussian);
  const double before = measure(original, noisy).mean_normal_error_deg;
  for (const Process process : {Process::kVertex, Process::kFace, Process::kBoth}) {
    for (const Solver solver : {Solver::kMetropolis, Solver::kMeanField}) {
      MrfOptions options;
      options.process = process;
      options.solver = solver;
      const Measurement after = test::measure_smoothed(noisy, original, options);
      EXPECT_LT(after.mean_normal_error_deg, 0.3 * before) << static_cast<int>(process) << static_cast<int>(solver);
      EXPECT_GT(after.labels->f1, 0.8) << static_cast<int>(process) << static_cast<int>(solver);
    }
  }
}

TEST(Process, AnyNumberOfThreadsGivesTheSameBits) {
  const Mesh noisy = add_noise(test::icosphere(4), 0.2, 1, NoiseKind::kGaussian);
  const Topology topology = build_topology(noisy);
  for (const Process process : {Process::kFace, Process::kBoth}) {
    for (const Solver solver : {Solver::kMetropolis, Solver::kMeanField}) {
      std::vector<SmoothResult> results;
      for (const std::uint32_t threads : {1U, 3U}) {
        MrfOptions options;
        options.process = process;
        options.solver = solver;
        options.sweeps = 20;
        RunContext context;
        results.push_back(smooth(noisy, topology, {options, threads}, context));
      }
      EXPECT_EQ(results[0].positions, results[1].positions);
      EXPECT_EQ(results[0].labels, results[1].labels);
    }
  }
}

}  // namespace
}  // namespace crease
