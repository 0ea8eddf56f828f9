#include "core/measure/measure.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "core/error.h"
#include "core/measure/noise.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

template <typename Call>
Error refusal(Call call) {
  try {
    call();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "nothing was refused";
  return {code::kInternal, ""};
}

TEST(Measure, AMeshHasNoErrorAgainstItself) {
  for (const auto& member : test::mesh_family()) {
    SCOPED_TRACE(member.name);
    const Measurement m = measure(member.mesh, member.mesh);
    EXPECT_EQ(m.mean_normal_error_deg, 0);
    EXPECT_EQ(m.max_normal_error_deg, 0);
    EXPECT_EQ(m.mean_vertex_error, 0);
    EXPECT_EQ(m.max_vertex_error, 0);
    EXPECT_EQ(m.volume_change, 0);
    EXPECT_FALSE(m.labels);
  }
}

TEST(Measure, TurningTheMeshTurnsEveryNormalOfAPlane) {
  const Mesh plane = test::grid(5, 5);
  for (const double degrees : {1e-6, 1.0, 90.0, 179.0, 180.0}) {
    Mesh turned = plane;
    const Eigen::AngleAxisd turn(degrees / 180 * M_PI, Vec3::UnitX());
    for (Vec3& position : turned.positions) position = turn * position;
    const Measurement m = measure(plane, turned);
    EXPECT_NEAR(m.mean_normal_error_deg, degrees, 1e-9);
    EXPECT_NEAR(m.max_normal_error_deg, degrees, 1e-9);
  }
}

TEST(Measure, TheMeanIsUnweightedOverFaces) {
  Mesh reference;
  reference.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 5}, {50, 0, 5}, {0, 50, 5}};
  reference.triangles = {{0, 1, 2}, {3, 4, 5}};
  Mesh mesh = reference;
  mesh.positions[2] = {0, 0, 1};
  const Measurement m = measure(reference, mesh);
  EXPECT_NEAR(m.mean_normal_error_deg, 45, 1e-12);
  EXPECT_NEAR(m.max_normal_error_deg, 90, 1e-12);
}

TEST(Measure, VertexErrorsAreInMeanEdgeLengthsOfTheReference) {
  const Mesh reference = test::icosphere(2, 10.0);
  const double unit = mean_edge_length(reference.positions, build_topology(reference).edges);
  Mesh mesh = reference;
  mesh.positions[4] += Vec3(0, 3 * unit, 4 * unit);
  const Measurement m = measure(reference, mesh);
  EXPECT_NEAR(m.max_vertex_error, 5, 1e-12);
  EXPECT_NEAR(m.mean_vertex_error, 5.0 / static_cast<double>(mesh.positions.size()), 1e-12);
}

TEST(Measure, VolumeChangesWithTheCubeOfTheScale) {
  for (const auto& member : test::mesh_family()) {
    if (!member.closed || !member.manifold) continue;
    SCOPED_TRACE(member.name);
    Mesh grown = member.mesh;
    for (Vec3& position : grown.positions) position *= 1.1;
    EXPECT_NEAR(measure(member.mesh, grown).volume_change, 1.1 * 1.1 * 1.1 - 1, 1e-6);
  }
}

TEST(Measure, AnOpenReferenceHasNoVolumeToChange) {
  const Mesh plane = test::grid(5, 5);
  EXPECT_EQ(measure(plane, add_noise(plane, 0.3, 1, NoiseKind::kGaussian)).volume_change, 0);
}

TEST(Measure, FacesWithoutAreaDoNotCountInTheNormalError) {
  for (const auto& member : test::mesh_family()) {
    if (!member.degenerate) continue;
    SCOPED_TRACE(member.name);
    Mesh turned = member.mesh;
    const Eigen::AngleAxisd turn(M_PI / 2, Vec3(1, 2, 3).normalized());
    for (Vec3& position : turned.positions) position = turn * position;
    Mesh sound = member.mesh, sound_turned = turned;
    std::erase_if(sound.triangles, [&](const Triangle& t) {
      const auto& p = member.mesh.positions;
      return (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]).isZero(0);
    });
    sound_turned.triangles = sound.triangles;
    EXPECT_NEAR(measure(member.mesh, turned).mean_normal_error_deg, measure(sound, sound_turned).mean_normal_error_deg,
                1e-9);
  }
}

TEST(Measure, CorrectLabelsScoreOneAndMissingOrFalseOnesLess) {
  const auto [part, ridges] = test::cad_part(2);
  EdgeLabels labels{ridges, std::vector<double>(ridges.size(), 0.5)};
  std::swap(labels.edges[3].v0, labels.edges[3].v1);
  const LabelScore all = *measure(part, part, &labels).labels;
  EXPECT_EQ(all.reference_ridges, ridges.size());
  EXPECT_EQ(all.labelled_ridges, ridges.size());
  EXPECT_EQ(all.f1, 1);

  const std::size_t kept = ridges.size() / 4;
  for (std::size_t i = kept; i < ridges.size(); ++i) labels.labels[i] = 0.49;
  const LabelScore some = *measure(part, part, &labels).labels;
  const double recall = static_cast<double>(kept) / static_cast<double>(ridges.size());
  EXPECT_EQ(some.precision, 1);
  EXPECT_DOUBLE_EQ(some.recall, recall);
  EXPECT_DOUBLE_EQ(some.f1, 2 * recall / (1 + recall));

  const Topology topology = build_topology(part);
  const EdgeLabels everything{topology.edges, std::vector<double>(topology.edges.size(), 1)};
  const LabelScore flooded = *measure(part, part, &everything).labels;
  EXPECT_EQ(flooded.recall, 1);
  EXPECT_DOUBLE_EQ(flooded.precision, static_cast<double>(ridges.size()) / static_cast<double>(topology.edges.size()));
}

TEST(Measure, WithoutRidgesEveryLabelIsWrong) {
  const Mesh plane = test::grid(4, 4);
  EdgeLabels labels;
  EXPECT_EQ(measure(plane, plane, &labels).labels->f1, 1);
  const Topology topology = build_topology(plane);
  for (std::size_t edge = 0; edge < topology.edges.size(); ++edge) {
    if (topology.is_interior(edge)) labels.edges.push_back(topology.edges[edge]);
  }
  labels.labels.assign(labels.edges.size(), 1);
  EXPECT_EQ(measure(plane, plane, &labels).labels->f1, 0);
  EXPECT_EQ(measure(plane, plane, &labels).labels->precision, 0);
}

TEST(Measure, BoundaryEdgesAreNotScored) {
  const Mesh plane = test::grid(3, 3);
  const Topology topology = build_topology(plane);
  EdgeLabels labels;
  for (std::size_t edge = 0; edge < topology.edges.size(); ++edge) {
    if (!topology.is_interior(edge)) labels.edges.push_back(topology.edges[edge]);
  }
  labels.labels.assign(labels.edges.size(), 1);
  EXPECT_EQ(measure(plane, plane, &labels).labels->labelled_ridges, 0U);
}

TEST(Measure, RefusesMeshesThatDoNotCorrespondAndNamesTheFirstDifference) {
  const Mesh reference = test::cube(2);
  Mesh more_vertices = reference, fewer_faces = reference, renumbered = reference;
  more_vertices.positions.emplace_back(0, 0, 0);
  fewer_faces.triangles.pop_back();
  std::rotate(renumbered.triangles[7].begin(), renumbered.triangles[7].begin() + 1, renumbered.triangles[7].end());
  for (const Mesh* other : {&more_vertices, &fewer_faces, &renumbered}) {
    const Error error = refusal([&] { measure(reference, *other); });
    EXPECT_EQ(error.code(), code::kMeshMismatch) << error.detail();
  }
  EXPECT_EQ(refusal([&] { measure(reference, renumbered); }).place(), "face 7");
}

TEST(Measure, RefusesALabelWithoutAnEdge) {
  const Mesh mesh = test::cube(2);
  const Edge first = build_topology(mesh).edges[0];
  const EdgeLabels astray{{first, {0, 0xfffffff0U}}, {1, 1}};
  const Error error = refusal([&] { measure(mesh, mesh, &astray); });
  EXPECT_EQ(error.code(), code::kMeshMismatch);
  EXPECT_EQ(error.place(), "label 1");
  const EdgeLabels uneven{{first}, {}};
  EXPECT_EQ(refusal([&] { measure(mesh, mesh, &uneven); }).code(), code::kMeshMismatch);
}

TEST(Measure, RefusesAReferenceWithoutExtent) {
  const Mesh point{std::vector<Vec3>(3, Vec3(1, 1, 1)), {{0, 1, 2}}};
  EXPECT_EQ(refusal([&] { measure(point, point); }).code(), code::kMeshNoExtent);
}

}  // namespace
}  // namespace crease
