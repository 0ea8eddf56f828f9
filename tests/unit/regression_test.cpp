#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include "core/graduated/energy.h"
#include "core/measure/measure.h"
#include "core/measure/noise.h"
#include "core/options/options.h"
#include "core/regression/face_turning.h"
#include "core/regression/label_regression.h"
#include "core/regression/normal_regression.h"
#include "core/regression/passes.h"
#include "core/regression/spokes.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

constexpr DescentSight kSight{.noise_sigma = 0.2, .weight = 0.1};

FlatMesh flat(const Mesh& mesh) { return FlatMesh(Surface(mesh, build_topology(mesh))); }

Vec3 vector_of(std::span<const float> flat, std::size_t i) {
  const auto v = vector_at(flat, i);
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

/// What the regression says of a noisy mesh whose result is a quieter one.
FlatVectors normals_of(const FlatMesh& noisy, const FlatMesh& quieter, std::uint32_t threads = 1, float amount = 1) {
  ThreadTeam team(threads);
  return regressed_normals(kFirstNormalNetwork, noisy, quieter.measured, {}, kSight, amount, team);
}

struct NoisyPart {
  Mesh noisy, quieter;
};
NoisyPart noisy_part() {
  const Mesh part = test::cad_part(6).mesh;
  return {add_noise(part, 0.2, 1, NoiseKind::kGaussian), add_noise(part, 0.05, 2, NoiseKind::kGaussian)};
}

Mesh transformed(Mesh mesh, const Eigen::Matrix3d& matrix) {
  for (Vec3& p : mesh.positions) p = matrix * p;
  if (matrix.determinant() < 0) {
    for (Triangle& t : mesh.triangles) std::swap(t[0], t[1]);
  }
  return mesh;
}

/// The frame of a face is arbitrary; what is found must not be.
TEST(NormalRegression, TurnsAndMirrorsWithTheMesh) {
  const auto [noisy, quieter] = noisy_part();
  const FlatVectors before = normals_of(flat(noisy), flat(quieter));
  Eigen::Matrix3d turn = Eigen::AngleAxisd(2, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  for (const double side : {1.0, -1.0}) {
    const Eigen::Matrix3d matrix = turn * Vec3(1, 1, side).asDiagonal();
    const FlatVectors after = normals_of(flat(transformed(noisy, matrix)), flat(transformed(quieter, matrix)));
    for (std::size_t f = 0; f < noisy.triangles.size(); ++f) {
      EXPECT_NEAR((matrix * vector_of(before, f) - vector_of(after, f)).norm(), 0, 2e-3) << f;
    }
  }
}

TEST(NormalRegression, IsTheSameForAnyNumberOfThreads) {
  const auto [noisy, quieter] = noisy_part();
  EXPECT_EQ(normals_of(flat(noisy), flat(quieter), 1), normals_of(flat(noisy), flat(quieter), 3));
}

TEST(NormalRegression, LeavesNormalsAloneByNoAmountAndTurnsThemByMore) {
  const auto [noisy, quieter] = noisy_part();
  const FlatMesh mesh = flat(noisy), result = flat(quieter);
  const FlatVectors none = normals_of(mesh, result, 1, 0), half = normals_of(mesh, result, 1, 0.5F),
                    whole = normals_of(mesh, result);
  double half_way = 0, all_the_way = 0;
  for (std::size_t f = 0; f < mesh.face_count; ++f) {
    const Vec3 n = vector_of(face_frame(result, result.measured, f).normal, 0);
    EXPECT_NEAR((vector_of(none, f) - n).norm(), 0, 1e-6);
    EXPECT_NEAR(vector_of(whole, f).norm(), 1, 1e-5);
    half_way += (vector_of(half, f) - n).norm();
    all_the_way += (vector_of(whole, f) - n).norm();
  }
  EXPECT_GT(half_way, 0);
  EXPECT_GT(all_the_way, 1.5 * half_way);
}

/// A network that was never told of this shape.
TEST(NormalRegression, BringsNormalsNearerToTheSurface) {
  const Mesh original = test::cylinder(48, 40, 1, 3);
  const FlatMesh noisy = flat(add_noise(original, 0.2, 1, NoiseKind::kGaussian));
  const FlatMesh quieter = flat(add_noise(original, 0.04, 1, NoiseKind::kGaussian)), truth = flat(original);
  const FlatVectors normals = normals_of(noisy, quieter);
  double before = 0, after = 0;
  for (std::size_t f = 0; f < truth.face_count; ++f) {
    const Vec3 n = vector_of(face_frame(truth, truth.measured, f).normal, 0);
    before += (vector_of(face_frame(quieter, quieter.measured, f).normal, 0) - n).norm();
    after += (vector_of(normals, f) - n).norm();
  }
  EXPECT_LT(after, 0.8 * before);
}

TEST(NormalRegression, SeesTheReferenceAndWithoutOneTheResultInItsPlace) {
  const auto [noisy, quieter] = noisy_part();
  const FlatMesh mesh = flat(noisy), result = flat(quieter), another = flat(test::cad_part(6).mesh);
  ThreadTeam alone(1);
  const auto normals_with = [&](std::span<const float> reference) {
    return regressed_normals(kFirstNormalNetwork, mesh, result.measured, reference, kSight, 1, alone);
  };
  EXPECT_EQ(normals_with(face_normals(mesh, result.measured, alone)), normals_with({}));
  EXPECT_NE(normals_with(face_normals(mesh, another.measured, alone)), normals_with({}));
}

Turned turned_by(std::size_t passes, const Mesh& noisy, const Mesh& quieter, std::uint32_t threads = 1) {
  ThreadTeam team(threads);
  return turned_in_passes(flat(noisy), flat(quieter).measured, {}, kSight, 1, {}, passes, team);
}

TEST(Passes, TurnAndMirrorWithTheMesh) {
  const auto [noisy, quieter] = noisy_part();
  const Turned before = turned_by(kPasses, noisy, quieter);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(2, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  for (const double side : {1.0, -1.0}) {
    const Eigen::Matrix3d matrix = turn * Vec3(1, 1, side).asDiagonal();
    const Turned after = turned_by(kPasses, transformed(noisy, matrix), transformed(quieter, matrix));
    for (std::size_t f = 0; f < noisy.triangles.size(); ++f) {
      EXPECT_NEAR((matrix * vector_of(before.normals, f) - vector_of(after.normals, f)).norm(), 0, 1e-2) << f;
    }
  }
}

TEST(Passes, AreTheSameForAnyNumberOfThreads) {
  const auto [noisy, quieter] = noisy_part();
  const Turned one = turned_by(kPasses, noisy, quieter, 1), three = turned_by(kPasses, noisy, quieter, 3);
  EXPECT_EQ(one.positions, three.positions);
  EXPECT_EQ(one.normals, three.normals);
}

TEST(Passes, BeginWithThePositionsAndTheNormalsOfTheReference) {
  const auto [noisy, quieter] = noisy_part();
  const FlatMesh mesh = flat(noisy), result = flat(quieter);
  ThreadTeam alone(1);
  const auto after_none = [&](std::span<const float> reference) {
    return turned_in_passes(mesh, result.measured, reference, kSight, 1, {}, 0, alone);
  };
  EXPECT_EQ(after_none(mesh.measured).positions, result.measured);
  EXPECT_EQ(after_none(mesh.measured).normals, face_normals(mesh, mesh.measured, alone));
  EXPECT_TRUE(after_none({}).normals.empty());
  EXPECT_EQ(turned_by(1, noisy, quieter).normals, normals_of(mesh, result));
}

/// The weight between two faces that lie on each other was once not a number, and spread.
TEST(NormalFeatures, AreFiniteAtTheSharpestFolds) {
  Mesh mesh = test::grid(8, 8);
  for (Vec3& p : mesh.positions) {
    if (p.x() > 4) p = Vec3(8 - p.x(), p.y(), 1e-4);
  }
  ThreadTeam alone(1);
  const FlatMesh folded = flat(mesh);
  const auto blocks = normal_features(folded, folded.measured, {}, kSight, alone);
  for (std::size_t f = 0; f < folded.face_count; ++f) {
    const NormalFeatures& block = blocks[f / NormalFeatures::kFaces];
    const std::size_t lane = f % NormalFeatures::kFaces;
    for (std::size_t k = 0; k < NormalFeatures::kVectors; ++k) {
      EXPECT_LE(std::hypot(block.x[k].load()[lane], block.y[k].load()[lane]), 1 + 1e-4) << f << " " << k;
    }
    for (const auto& scalars : block.scalars) EXPECT_LE(std::abs(scalars.load()[lane]), 20) << f;
  }
}

TEST(NormalRegression, GivesFacesWithoutAreaNoNormal) {
  for (const auto& [name, mesh, manifold, closed, degenerate] : test::mesh_family()) {
    const Topology topology = build_topology(mesh);
    if (!has_extent(mesh, topology)) continue;
    const FlatMesh flat_mesh{Surface(mesh, topology)};
    const FlatVectors normals = normals_of(flat_mesh, flat_mesh);
    for (std::size_t f = 0; f < flat_mesh.face_count; ++f) {
      const auto area = area_vector(flat_mesh, flat_mesh.measured, f);
      const bool flat_face = area == std::array<float, 3>{};
      EXPECT_NEAR(vector_of(normals, f).norm(), flat_face ? 0 : 1, 1e-4) << name << " " << f;
    }
  }
}

/// Looking for what goes on beyond each edge at the tip of a fan once took the square of their number.
TEST(Spokes, AreThoseThatTurnMostWhereThereAreVeryMany) {
  constexpr int kBlades = 300;
  Mesh fan;
  fan.positions.emplace_back(0, 0, 20);
  for (int i = 0; i < kBlades; ++i) {
    const double angle = 2 * std::numbers::pi * i / kBlades;
    fan.positions.emplace_back(50 * std::cos(angle), 50 * std::sin(angle), 0);
  }
  for (Index i = 0; i < kBlades; ++i) fan.triangles.push_back({0, i + 1, (i + 1) % kBlades + 1});
  const FlatMesh mesh = flat(fan);
  ASSERT_EQ(mesh.edge_count, kBlades);
  std::vector<float> turns(mesh.edge_count), others(mesh.edge_count);
  for (std::size_t e = 0; e < mesh.edge_count; ++e) {
    (e % 2 == 0 ? turns : others)[e] = static_cast<float>(e * 7 % kBlades);
  }
  const Spokes spokes(mesh, turns, others);
  const std::span<const Index> found = spokes.at(0);
  EXPECT_EQ(found.size(), Spokes::kOfMore);
  for (const Index e : found) EXPECT_GE(std::max(turns[e], others[e]), kBlades - static_cast<int>(Spokes::kOfMore));
  const std::span<const Index> at_rim = spokes.at(1);
  EXPECT_TRUE(std::ranges::equal(at_rim, mesh.vertex_stencils[1]));
}

/// A sheet of the plane, bent by `angle` about the line y = 8 and, for a chamfer, about y = 9, too.
Mesh bent_sheet(double angle, bool chamfered) {
  Mesh mesh = test::grid(60, 17);
  for (Vec3& p : mesh.positions) {
    const double first = std::clamp(p.y() - 8, 0.0, chamfered ? 1.0 : 9.0), second = std::max(0.0, p.y() - 8 - first);
    p = Vec3(p.x(), std::min(8.0, p.y()) + first * std::cos(angle) + second * std::cos(2 * angle),
             first * std::sin(angle) + second * std::sin(2 * angle));
  }
  return mesh;
}

/// What is seen of the edges of a result along y = 8, far from the ends of the sheet: root mean squares of how far the
/// turns of the upload are from `turn`, at the edges themselves and over ever longer walks; means of the others.
struct AlongRidge {
  double here = 0, few = 0, many = 0;
  double turn_of_result = 0, sharper = 0;
};
AlongRidge seen_along_ridge(const Mesh& upload, const Mesh& result, double turn) {
  constexpr std::size_t kUploadHere = 3, kWalks = LabelFeatures::kCount - RidgeWalks::kFeatures;
  ThreadTeam team(1);
  const FlatMesh mesh(build_topology(upload), upload.triangles, upload.positions);
  FlatVectors positions = mesh.measured;
  for (std::size_t v = 0; v < mesh.vertex_count; ++v) {
    const Eigen::Vector3f moved = (result.positions[v] - upload.positions[v]).cast<float>();
    const auto [x, y, z] = vector_at(mesh.measured, v);
    set_vector(positions, v, {x + moved[0], y + moved[1], z + moved[2]});
  }
  const LabelFeatures features(mesh, positions, {}, {}, kSight, team);
  const Mesh flat_sheet = test::grid(60, 17);
  AlongRidge sums;
  double count = 0;
  for (std::size_t e = 0; e < mesh.edge_count; ++e) {
    const auto end = [&](std::size_t side) {
      return flat_sheet.positions[static_cast<std::size_t>(mesh.edge_ends[side][e])];
    };
    if (end(0).y() != 8 || end(1).y() != 8 || end(0).x() < 20 || end(0).x() > 40) continue;
    const auto feature = [&](std::size_t number) {
      return static_cast<double>(features.block(e / kLaneCount)[number][e % kLaneCount]);
    };
    sums.here += std::pow(feature(kUploadHere) - turn, 2);
    sums.few += std::pow(feature(kWalks) - turn, 2);
    sums.many += std::pow(feature(kWalks + 3) - turn, 2);
    sums.turn_of_result += feature(kWalks + 4);
    sums.sharper += feature(kWalks + 5);
    ++count;
  }
  EXPECT_GT(count, 15);
  for (double* square : {&sums.here, &sums.few, &sums.many}) *square = std::sqrt(*square / count);
  for (double* sum : {&sums.turn_of_result, &sums.sharper}) *sum /= count;
  return sums;
}

TEST(RidgeWalks, TellHowFarTheUploadTurnsWhereSingleEdgesDoNot) {
  constexpr double kAngle = 0.7, kTurn = 0.6858;  // 2 sin 0.35
  for (const double angle : {kAngle, -kAngle}) {
    const Mesh original = bent_sheet(angle, false);
    const AlongRidge seen = seen_along_ridge(add_noise(original, 0.2, 3, NoiseKind::kGaussian), original, kTurn);
    EXPECT_NEAR(seen.turn_of_result, kTurn, 1e-4);
    EXPECT_LT(seen.few, 0.6 * seen.here);
    EXPECT_LT(seen.many, 0.7 * seen.few);
    EXPECT_NEAR(seen.sharper, 0, 0.06);
  }
}

/// A chamfer of two lines of 22.5°, one edge apart, that comes out as one crease of 45°, as if its first line went on
/// to where both walls meet: 0.541 further on their plane, 0.207 outwards.
TEST(RidgeWalks, TellAChamferFromTheCreaseThatItBecame) {
  constexpr double kAngle = 22.5 * kDegree, kTurn = 0.3902, kTurnOfCrease = 0.7654;  // 2 sin of half the angle
  for (const double angle : {kAngle, -kAngle}) {
    const Mesh original = bent_sheet(angle, true), noisy = add_noise(original, 0.2, 3, NoiseKind::kGaussian);
    Mesh creased = original;
    for (Vec3& p : creased.positions) {
      if (p.y() == 8) p.y() += 0.5 / std::cos(kAngle);
    }
    const AlongRidge seen = seen_along_ridge(noisy, creased, kTurn);
    EXPECT_NEAR(seen.turn_of_result, kTurnOfCrease, 1e-4);
    EXPECT_LT(seen.many, 0.15);
    EXPECT_NEAR(seen.sharper, 0.207, 0.06);
  }
}

/// What the regression says of the edges of a noisy mesh whose result is a quieter one.
std::vector<float> labels_of(const FlatMesh& noisy, const FlatMesh& quieter, std::uint32_t threads = 1) {
  ThreadTeam team(threads);
  const LabelFeatures features(noisy, quieter.measured, {}, normals_of(noisy, quieter), kSight, team);
  return regressed_labels(noisy, features, team);
}

TEST(LabelRegression, TurnsAndMirrorsWithTheMesh) {
  const auto [noisy, quieter] = noisy_part();
  const std::vector<float> before = labels_of(flat(noisy), flat(quieter));
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(2, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  for (const double side : {1.0, -1.0}) {
    const Eigen::Matrix3d matrix = turn * Vec3(1, 1, side).asDiagonal();
    const FlatMesh turned = flat(transformed(noisy, matrix));
    std::vector<float> after = labels_of(turned, flat(transformed(quieter, matrix)));
    // Edges are numbered as faces use them, which mirroring changes.
    std::map<std::pair<FlatIndex, FlatIndex>, float> by_ends;
    for (std::size_t e = 0; e < after.size(); ++e) {
      by_ends[{turned.edge_ends[0][e], turned.edge_ends[1][e]}] = after[e];
    }
    const FlatMesh mesh = flat(noisy);
    for (std::size_t e = 0; e < before.size(); ++e) {
      EXPECT_NEAR(before[e], by_ends.at({mesh.edge_ends[0][e], mesh.edge_ends[1][e]}), 1e-2) << e;
    }
  }
}

TEST(LabelRegression, IsTheSameForAnyNumberOfThreads) {
  const auto [noisy, quieter] = noisy_part();
  EXPECT_EQ(labels_of(flat(noisy), flat(quieter), 1), labels_of(flat(noisy), flat(quieter), 3));
}

TEST(LabelRegression, TellsRidgesFromFlats) {
  const test::CadPart part = test::cad_part(6);
  const FlatMesh mesh = flat(noisy_part().noisy);
  std::set<std::pair<FlatIndex, FlatIndex>> ridges;
  for (const Edge& edge : part.ridges) {
    ridges.emplace(static_cast<FlatIndex>(std::min(edge.v0, edge.v1)),
                   static_cast<FlatIndex>(std::max(edge.v0, edge.v1)));
  }
  for (const double noise_of_result : {0.0, 0.02}) {
    const Mesh result = add_noise(part.mesh, noise_of_result, 2, NoiseKind::kGaussian);
    const std::vector<float> labels = labels_of(mesh, flat(result));
    std::size_t right = 0, known = 0;
    for (std::size_t e = 0; e < labels.size(); ++e) {
      const bool is_ridge = ridges.contains({mesh.edge_ends[0][e], mesh.edge_ends[1][e]});
      EXPECT_TRUE(labels[e] >= 0 && labels[e] <= 1) << e;
      known += is_ridge ? 1 : 0;
      right += (labels[e] > 0.5F) == is_ridge ? 1 : 0;
    }
    EXPECT_EQ(known, part.ridges.size());
    EXPECT_GT(static_cast<double>(right), 0.99 * static_cast<double>(labels.size())) << noise_of_result;
  }
}

TEST(LabelRegression, GivesProbabilitiesToEveryMesh) {
  for (const auto& [name, mesh, manifold, closed, degenerate] : test::mesh_family()) {
    const Topology topology = build_topology(mesh);
    if (!has_extent(mesh, topology)) continue;
    const FlatMesh flat_mesh{Surface(mesh, topology)};
    for (const float label : labels_of(flat_mesh, flat_mesh)) EXPECT_TRUE(label >= 0 && label <= 1) << name;
  }
}

/// Normals of a short wave over a plane bring the wave up; a long one is held where the positions have it.
TEST(TurnedTowards, FindsTheSurfaceThatTheNormalsAreOf) {
  const auto share_that_is_left = [](double length) {
    const Mesh plane = test::grid(40, 40);
    Mesh wave = plane;
    for (Vec3& p : wave.positions) p.z() = 0.02 * length * std::sin(2 * std::numbers::pi * p.x() / length);
    const FlatMesh start = flat(plane), goal = flat(wave);
    ThreadTeam one(1), two(2);
    const FlatVectors normals = face_normals(goal, goal.measured, one);
    const FlatVectors found = turned_towards(start, start.measured, normals, {}, one);
    EXPECT_EQ(found, turned_towards(start, start.measured, normals, {}, two));
    double before = 0, after = 0;
    for (std::size_t f = 0; f < goal.face_count; ++f) {
      const Vec3 n = vector_of(normals, f);
      before += (vector_of(face_frame(start, start.measured, f).normal, 0) - n).norm();
      after += (vector_of(face_frame(start, found, f).normal, 0) - n).norm();
    }
    return after / before;
  };
  EXPECT_LT(share_that_is_left(4), 0.25);
  EXPECT_GT(share_that_is_left(40), 0.6);
}

TEST(TurnedTowards, LeavesFacesWithoutATargetAndVerticesThatAreHeldWhereTheyAre) {
  const FlatMesh mesh = flat(test::grid(6, 6));
  ThreadTeam alone(1);
  EXPECT_EQ(turned_towards(mesh, mesh.measured, FlatVectors(3 * mesh.face_count, 0), {}, alone), mesh.measured);
  FlatVectors tilted(3 * mesh.face_count, 0);
  std::fill(tilted.begin(), tilted.begin() + static_cast<std::ptrdiff_t>(mesh.face_count), 0.6F);
  std::fill(tilted.end() - static_cast<std::ptrdiff_t>(mesh.face_count), tilted.end(), 0.8F);
  const std::vector<float> held(mesh.vertex_count, 1e6F);
  const FlatVectors found = turned_towards(mesh, mesh.measured, tilted, held, alone);
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], mesh.measured[i], 1e-4);
}

}  // namespace
}  // namespace crease
