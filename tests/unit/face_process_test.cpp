#include "core/solve/face_process.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "core/measure/measure.h"
#include "core/measure/noise.h"
#include "core/smooth/smooth.h"
#include "core/solve/vertex_fit.h"
#include "tests/support/meshes.h"
#include "tests/support/smooth_support.h"

namespace crease {
namespace {

MrfOptions options_with(Smoothness shape) {
  MrfOptions options;
  options.smoothness = shape;
  options.smoothness_weight = 1.3;
  return options;
}

TEST(FaceProcess, ANormalsDeltaIsTheDifferenceOfTheFullEnergies) {
  for (const auto& [name, mesh, manifold, closed, degenerate] : test::mesh_family()) {
    for (const Smoothness shape : {Smoothness::kQuadratic, Smoothness::kSquareRoot, Smoothness::kTruncated}) {
      const Topology topology = build_topology(mesh);
      test::FieldWithEnergy state(test::shaken_field(mesh, topology, 5), options_with(shape));
      Field& field = state.field;
      ThreadTeam& alone = state.alone;
      FaceProcess process(field, state.terms, 0.4, 0.6);
      process.measure(alone);
      process.labels_changed(alone);
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

TEST(FaceProcess, FacesAcrossACornerAreCoupledByTheBetterWayRound) {
  const Mesh mesh = test::icosphere(0);  // five faces round every vertex
  const Topology topology = build_topology(mesh);
  const auto smoothness = [&](double all, Index cut) {
    Field field(mesh, topology);
    std::ranges::fill(field.labels, all);
    if (cut != kNone) field.labels[cut] = 1;
    test::FieldWithEnergy state(std::move(field), options_with(Smoothness::kQuadratic));
    FaceProcess process(state.field, state.terms, 0, 1);
    process.measure(state.alone);
    process.labels_changed(state.alone);
    return process.smoothness(state.alone);
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
  const auto normal = [&](Index f) { return Vec3(field.normals[f].head<3>().cast<double>()); };
  fit_vertices(
      field, 100, normal, [](std::size_t) { return true; }, alone);
  Mesh fitted = noisy;
  fitted.positions = field.upload_positions(noisy);
  EXPECT_LT(measure(original, fitted).mean_normal_error_deg, 0.1 * measure(original, noisy).mean_normal_error_deg);
}

// The paper's Fig. 6.
TEST(Process, EachSmoothsANoisyCubeAndFindsItsRidges) {
  const Mesh original = test::cube(10);
  const Mesh noisy = add_noise(original, 0.2, 1, NoiseKind::kGaussian);
  const double before = measure(original, noisy).mean_normal_error_deg;
  for (const Process process : {Process::kVertex, Process::kFace, Process::kBoth}) {
    MrfOptions options;
    options.solver = Solver::kMetropolis;
    options.process = process;
    const Measurement after = test::measure_smoothed(noisy, original, options);
    EXPECT_LT(after.mean_normal_error_deg, 0.3 * before) << static_cast<int>(process);
    EXPECT_GT(after.labels->f1, 0.8) << static_cast<int>(process);
  }
}

TEST(Process, AnyNumberOfThreadsGivesTheSameBits) {
  const Mesh noisy = add_noise(test::icosphere(4), 0.2, 1, NoiseKind::kGaussian);
  const Topology topology = build_topology(noisy);
  for (const Process process : {Process::kFace, Process::kBoth}) {
    std::vector<SmoothResult> results;
    for (const std::uint32_t threads : {1U, 3U}) {
      MrfOptions options;
      options.solver = Solver::kMetropolis;
      options.process = process;
      options.sweeps = 20;
      RunContext context;
      results.push_back(smooth(noisy, topology, {options, threads}, context));
    }
    EXPECT_EQ(results[0].positions, results[1].positions);
    EXPECT_EQ(results[0].labels, results[1].labels);
  }
}

}  // namespace
}  // namespace crease
