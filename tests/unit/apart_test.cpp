#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "core/base/state_archive.h"
#include "core/measure/noise.h"
#include "core/mesh/mesh_parts.h"
#include "core/smooth/smooth.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

Mesh cube_with_noise() { return add_noise(test::cube(12), 0.25, 1, NoiseKind::kNormal); }
Mesh ball_with_noise() {
  return test::moved(add_noise(test::icosphere(3), 0.1, 2, NoiseKind::kGaussian), 9, Vec3(30, 0, 0));
}
Mesh cube_and_ball() { return test::joined({ball_with_noise(), cube_with_noise()}); }  // the cube has more faces

SmoothResult smoothed(const Mesh& mesh, const MrfOptions& options, RunContext& context,
                      std::span<const double> weights = {}, std::uint32_t threads = 1) {
  return smooth(mesh, build_topology(mesh), {options, threads}, context, weights);
}

SmoothResult smoothed(const Mesh& mesh, const MrfOptions& options = {}, std::span<const double> weights = {}) {
  RunContext context;
  return smoothed(mesh, options, context, weights);
}

template <typename Item>
std::vector<Item> picked(const std::vector<Item>& all, const std::vector<Index>& places) {
  std::vector<Item> some;
  for (const Index place : places) some.push_back(all[place]);
  return some;
}

TEST(MeshParts, AreComponentsUnlikeTheOthers) {
  const Mesh mesh = cube_and_ball();
  const auto parts = parts_of(mesh, build_topology(mesh));
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_EQ(parts[0].mesh.positions, cube_with_noise().positions) << "the larger one comes first";
  EXPECT_EQ(parts[1].mesh.positions, ball_with_noise().positions);
  EXPECT_EQ(parts[0].mesh.triangles, cube_with_noise().triangles);
  EXPECT_TRUE(parts_of(cube_with_noise(), build_topology(cube_with_noise())).empty());
  const Mesh with_debris = test::joined({cube_with_noise(), test::moved(test::cube(4), 1, Vec3(3, 0, 0))});
  EXPECT_TRUE(parts_of(with_debris, build_topology(with_debris)).empty()) << "192 faces tell too little";
}

TEST(MeshParts, AreAlikeOnlyWhereTheyHaveManyFaces) {
  const Mesh few = test::joined({test::cube(12), test::moved(test::cube(12), 1.5, Vec3(3, 0, 0))});
  EXPECT_TRUE(parts_of(few, build_topology(few)).empty());
  const Mesh many = test::joined({test::cube(19), test::moved(test::cube(19), 1, Vec3(3, 0, 0))});
  EXPECT_EQ(parts_of(many, build_topology(many)).size(), 2U);
}

TEST(MeshParts, SmallComponentsGoWhereEdgesAreAlike) {
  const Mesh coarse = test::moved(test::cube(2), 3, Vec3(60, 0, 0)),
             fine = test::moved(test::cube(2), 0.2, Vec3(0, 5, 0));
  Mesh mesh = test::joined({coarse, ball_with_noise(), fine, cube_with_noise()});
  mesh.positions.emplace_back(7, 7, 7);  // isolated
  const std::size_t point = mesh.positions.size();
  mesh.positions.emplace_back(8, 8, 8);  // of a face without extent
  const auto a = static_cast<Index>(point);
  mesh.triangles.push_back({a, a, a});
  const auto parts = parts_of(mesh, build_topology(mesh));
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_EQ(parts[0].mesh.triangles.size(), cube_with_noise().triangles.size() + fine.triangles.size() + 1);
  EXPECT_EQ(parts[1].mesh.triangles.size(), ball_with_noise().triangles.size() + coarse.triangles.size());
  std::vector<int> seen(mesh.positions.size(), 0);
  for (const MeshPart& part : parts) {
    for (const Index v : part.vertices) ++seen[v];
  }
  EXPECT_TRUE(std::ranges::all_of(seen, [](int times) { return times == 1; }));
}

TEST(MeshParts, AreNoMoreThanThereIsTimeFor) {
  std::vector<Mesh> many;
  for (int i = 0; i < 40; ++i) many.push_back(test::moved(test::cube(7), std::pow(1.7, i), Vec3(0, 0, 0)));
  const Mesh mesh = test::joined(many);
  const auto parts = parts_of(mesh, build_topology(mesh));
  ASSERT_EQ(parts.size(), kMostParts);
  std::size_t faces = 0;
  for (const MeshPart& part : parts) faces += part.mesh.triangles.size();
  EXPECT_EQ(faces, mesh.triangles.size());
}

TEST(MeshParts, HaveTheTopologyOfTheWhole) {
  Mesh mesh = test::joined({test::mobius(300), ball_with_noise(), test::grid(20, 20, 90)});
  std::mt19937 random(1);
  std::ranges::shuffle(mesh.triangles, random);
  for (Triangle& triangle : mesh.triangles) {
    if (random() % 3 == 0) std::swap(triangle[0], triangle[1]);
  }
  const Topology whole = build_topology(mesh);
  const auto parts = parts_of(mesh, whole);
  ASSERT_EQ(parts.size(), 3U);
  for (const MeshPart& part : parts) {
    const Topology topology = build_topology(part.mesh);
    ASSERT_EQ(topology.edges.size(), part.edges.size());
    EXPECT_EQ(topology.edge_face_count, picked(whole.edge_face_count, part.edges));
    EXPECT_EQ(topology.edge_twisted, picked(whole.edge_twisted, part.edges));
    for (std::size_t e = 0; e < part.edges.size(); ++e) {
      const auto [v0, v1] = topology.edges[e];
      EXPECT_EQ((Edge{part.vertices[v0], part.vertices[v1]}), whole.edges[part.edges[e]]);
    }
  }
}

TEST(SmoothApart, EachPartComesOutAsItDoesAlone) {
  const Mesh mesh = cube_and_ball();
  const auto parts = parts_of(mesh, build_topology(mesh));
  ASSERT_EQ(parts.size(), 2U);
  for (const bool uncertainty : {false, true}) {
    MrfOptions options;
    options.uncertainty = uncertainty;
    const SmoothResult together = smoothed(mesh, options);
    ASSERT_TRUE(together.choice);
    ASSERT_EQ(together.other_choices.size(), 1U);
    double unit = mean_edge_length(mesh.positions, build_topology(mesh).edges);
    std::size_t sweeps = 0;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const SmoothResult alone = smoothed(parts[i].mesh, options);
      EXPECT_EQ(picked(together.positions, parts[i].vertices), alone.positions);
      EXPECT_EQ(picked(together.labels, parts[i].edges), alone.labels);
      EXPECT_EQ(together.sigma.empty(), !uncertainty);
      if (uncertainty) {
        EXPECT_EQ(picked(together.sigma, parts[i].vertices), alone.sigma);
      }
      const ChoiceReport& choice = i == 0 ? *together.choice : together.other_choices[0];
      EXPECT_EQ(choice.faces, parts[i].mesh.triangles.size());
      EXPECT_EQ(choice.family, alone.choice->family);
      const double own_unit = mean_edge_length(parts[i].mesh.positions, build_topology(parts[i].mesh).edges);
      EXPECT_NEAR(choice.noise_sigma * unit, alone.choice->noise_sigma * own_unit, 1e-12);
      for (std::size_t k = 0; k < alone.sweeps.size(); ++k) {
        EXPECT_NEAR(together.sweeps.at(sweeps + k).rms_displacement * unit, alone.sweeps[k].rms_displacement * own_unit,
                    1e-12);
      }
      sweeps += alone.sweeps.size();
    }
    EXPECT_EQ(together.sweeps.size(), sweeps);
    for (std::size_t k = 0; k < sweeps; ++k) EXPECT_EQ(together.sweeps[k].sweep, k + 1);
  }
}

/// In lengths of the whole, so that a part with longer edges has less of it in its own.
TEST(SmoothApart, AGivenLevelOfNoiseIsThatOfTheUpload) {
  const Mesh mesh = cube_and_ball();
  const auto parts = parts_of(mesh, build_topology(mesh));
  const double unit = mean_edge_length(mesh.positions, build_topology(mesh).edges);
  MrfOptions options;
  options.noise_sigma = 0.1;
  const SmoothResult together = smoothed(mesh, options);
  EXPECT_NEAR(together.choice->noise_sigma, 0.1, 1e-12);
  EXPECT_NEAR(together.other_choices.at(0).noise_sigma, 0.1, 1e-12);
  for (const MeshPart& part : parts) {
    options.noise_sigma = 0.1 * unit / mean_edge_length(part.mesh.positions, build_topology(part.mesh).edges);
    EXPECT_EQ(picked(together.positions, part.vertices), smoothed(part.mesh, options).positions);
  }
}

TEST(SmoothApart, WeightsGoWithTheirVertices) {
  const Mesh mesh = cube_and_ball();
  std::vector<double> weights(mesh.positions.size(), 0);
  const auto parts = parts_of(mesh, build_topology(mesh));
  std::vector<std::vector<double>> of_parts;
  for (const MeshPart& part : parts) {
    std::vector<double>& some = of_parts.emplace_back(part.vertices.size(), 1);
    ASSERT_EQ(some.size() % 2, 0U);
    for (std::size_t v = 0; v < some.size(); ++v) some[v] = v < some.size() / 2 ? 1.5 : 0.5;  // 1 on average
    for (std::size_t v = 0; v < some.size(); ++v) weights[part.vertices[v]] = some[v];
  }
  const SmoothResult together = smoothed(mesh, {}, weights);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    EXPECT_EQ(picked(together.positions, parts[i].vertices), smoothed(parts[i].mesh, {}, of_parts[i]).positions);
  }
}

TEST(SmoothApart, ARunGoesOnFromAnySweep) {
  const Mesh mesh = cube_and_ball();
  const SmoothResult expected = smoothed(mesh);
  std::string checkpoint;
  for (std::uint32_t last = 1; last <= expected.sweeps.size(); ++last) {  // each goes on from the one before
    const std::string from = checkpoint;
    RunContext context;
    context.checkpoint = from;
    double fraction = 0;
    context.on_sweep = [&](const SweepView& view) {
      EXPECT_LE(view.record.sweep, view.sweeps);
      EXPECT_GE(view.fraction.value(), fraction);
      fraction = *view.fraction;
      checkpoint = view.checkpoint();
      return view.record.sweep < last;
    };
    ASSERT_TRUE(smoothed(mesh, {}, context).cancelled);
    EXPECT_EQ(context.checkpoint, from) << "what the caller has given is the caller's";
    EXPECT_TRUE(context.on_sweep);
    RunContext again;
    again.checkpoint = checkpoint;
    const SmoothResult resumed = smoothed(mesh, {}, again, {}, 3);
    EXPECT_EQ(resumed.positions, expected.positions);
    EXPECT_EQ(resumed.labels, expected.labels);
    ASSERT_EQ(resumed.sweeps.size(), expected.sweeps.size());
    ASSERT_EQ(resumed.other_choices.size(), 1U);
    EXPECT_EQ(resumed.choice->candidates.size(), expected.choice->candidates.size());
    EXPECT_EQ(resumed.choice->family, expected.choice->family);
  }
}

TEST(SmoothApart, ATornCheckpointIsRefused) {
  const Mesh mesh = cube_and_ball();
  const auto sweeps = static_cast<std::uint32_t>(smoothed(mesh).sweeps.size());
  std::string checkpoint;
  RunContext context;
  context.on_sweep = [&](const SweepView& view) {
    if (view.record.sweep < sweeps) return true;
    checkpoint = view.checkpoint();
    return false;
  };
  smoothed(mesh, {}, context);
  for (std::size_t length = 1; length < checkpoint.size(); length += 1 + checkpoint.size() / 31) {
    RunContext again;
    const std::string torn = checkpoint.substr(0, length);
    again.checkpoint = torn;
    EXPECT_THROW(smoothed(mesh, {}, again), CheckpointError) << length;
  }
  RunContext other;
  other.checkpoint = checkpoint;
  EXPECT_THROW(smoothed(cube_with_noise(), {}, other), CheckpointError);
}

TEST(SmoothApart, WhatIsDoneStaysWhenARunIsCancelled) {
  const Mesh mesh = cube_and_ball();
  const auto parts = parts_of(mesh, build_topology(mesh));
  const SmoothResult whole = smoothed(mesh);
  const std::size_t of_first = smoothed(parts[0].mesh).sweeps.size();
  std::vector<Vec3> shown;
  RunContext context;
  context.on_sweep = [&](const SweepView& view) {
    if (view.record.sweep <= of_first) return true;
    shown = view.positions();
    return false;
  };
  const SmoothResult result = smoothed(mesh, {}, context);
  EXPECT_TRUE(result.cancelled);
  EXPECT_EQ(picked(shown, parts[0].vertices), picked(whole.positions, parts[0].vertices));
  EXPECT_EQ(picked(result.positions, parts[0].vertices), picked(whole.positions, parts[0].vertices));
  EXPECT_EQ(picked(result.labels, parts[0].edges), picked(whole.labels, parts[0].edges));
  for (const double label : picked(result.labels, parts[1].edges)) EXPECT_EQ(label, 0);
}

}  // namespace
}  // namespace crease
