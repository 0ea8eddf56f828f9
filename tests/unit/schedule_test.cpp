#include "core/solve/schedule.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <numbers>

#include "core/geometry/renumbering.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

using test::mesh_family;

std::vector<test::NamedMesh> family_and_larger() {
  auto meshes = mesh_family();
  meshes.push_back({"large sphere", Renumbering(test::icosphere(5)).mesh, true, true, false});
  return meshes;
}

using TouchedBy = std::function<std::vector<Index>(Index site)>;

/// Checks that no two tasks of a phase touch the same vertex.
void expect_tasks_apart(const Schedule& schedule, const TouchedBy& touched_by, const std::string& name) {
  for (std::size_t phase = 0; phase + 1 < schedule.phases.size(); ++phase) {
    std::map<Index, std::size_t> task_at;
    for (std::size_t task = schedule.phases[phase]; task < schedule.phases[phase + 1]; ++task) {
      const std::size_t first = schedule.runs[schedule.tasks[task]], last = schedule.runs[schedule.tasks[task + 1]];
      for (std::size_t i = first; i < last; ++i) {
        for (const Index vertex : touched_by(schedule.sites[i])) {
          EXPECT_EQ(task_at.try_emplace(vertex, task).first->second, task) << name << " vertex " << vertex;
        }
      }
    }
  }
}

void expect_each_once(const Schedule& schedule, const std::vector<Index>& expected, const std::string& name) {
  std::vector<Index> sites = schedule.sites;
  std::ranges::sort(sites);
  EXPECT_EQ(sites, expected) << name;
  EXPECT_EQ(schedule.runs.back(), schedule.sites.size()) << name;
  EXPECT_EQ(schedule.tasks.back() + 1, schedule.runs.size()) << name;
  EXPECT_EQ(schedule.phases.back() + 1, schedule.tasks.size()) << name;
}

/// A cone of `spokes` faces round vertex 0.
Mesh cone(Index spokes) {
  Mesh mesh;
  mesh.positions.emplace_back(0, 0, 1);
  for (Index i = 0; i < spokes; ++i) {
    const double angle = 2 * std::numbers::pi * i / spokes;
    mesh.positions.emplace_back(std::cos(angle), std::sin(angle), 0);
    mesh.triangles.push_back({0, 1 + i, 1 + (i + 1) % spokes});
  }
  return mesh;
}

TEST(Schedule, VerticesOfFacesAreVisitedOnceAndTasksOfAPhaseLieApart) {
  for (const auto& [name, mesh, manifold, closed, degenerate] : family_and_larger()) {
    const Topology topology = build_topology(mesh);
    const Schedule schedule = schedule_vertices(mesh, topology);
    std::vector<Index> expected;
    for (Index v = 0; v < mesh.positions.size(); ++v) {
      if (!topology.vertex_faces[v].empty()) expected.push_back(v);
    }
    expect_each_once(schedule, expected, name);
    expect_tasks_apart(
        schedule,
        [&, &m = mesh](Index site) {
          std::vector<Index> touched;
          for (const Index f : topology.vertex_faces[site]) {
            touched.insert(touched.end(), m.triangles[f].begin(), m.triangles[f].end());
          }
          return touched;
        },
        name);
  }
}

TEST(Schedule, VerticesOfARunAreNotNeighbours) {
  for (const auto& [name, mesh, manifold, closed, degenerate] : family_and_larger()) {
    const Topology topology = build_topology(mesh);
    const Schedule schedule = schedule_vertices(mesh, topology);
    std::vector<std::size_t> run_of(mesh.positions.size(), schedule.runs.size());
    for (std::size_t run = 0; run + 1 < schedule.runs.size(); ++run) {
      for (std::size_t i = schedule.runs[run]; i < schedule.runs[run + 1]; ++i) run_of[schedule.sites[i]] = run;
    }
    const auto expect_different = [&, &label = name](Index a, Index b) {
      if (a != b) {
        EXPECT_NE(run_of[a], run_of[b]) << label;
      }
    };
    for (const auto& [a, b, c] : mesh.triangles) {
      expect_different(a, b);
      expect_different(b, c);
      expect_different(c, a);
    }
    for (std::size_t e = 0; e < topology.edges.size(); ++e) {
      if (!topology.is_interior(e)) continue;
      for (const Index a : mesh.triangles[topology.edge_faces[e][0]]) {
        for (const Index b : mesh.triangles[topology.edge_faces[e][1]]) expect_different(a, b);
      }
    }
  }
}

TEST(Schedule, InteriorEdgesAreVisitedOnceAndTasksOfAPhaseLieApart) {
  for (const auto& [name, mesh, manifold, closed, degenerate] : family_and_larger()) {
    const Topology topology = build_topology(mesh);
    const Schedule schedule = schedule_edges(topology);
    std::vector<Index> expected;
    for (Index e = 0; e < topology.edges.size(); ++e) {
      if (topology.is_interior(e)) expected.push_back(e);
    }
    expect_each_once(schedule, expected, name);
    expect_tasks_apart(
        schedule,
        [&](Index e) {
          return std::vector<Index>{topology.edges[e].v0, topology.edges[e].v1};
        },
        name);
  }
}

TEST(Schedule, ALargeMeshGivesManyThreadsWorkAtOnce) {
  const Mesh mesh = Renumbering(test::icosphere(5)).mesh;
  const Schedule schedule = schedule_vertices(mesh, build_topology(mesh));
  EXPECT_LE(schedule.phases.size() - 1, (schedule.tasks.size() - 1) / 4);
}

TEST(Schedule, AHubOfManyFacesIsHandled) {
  const Mesh mesh = cone(100'000);
  const Topology topology = build_topology(mesh);
  EXPECT_EQ(schedule_edges(topology).sites.size(), 200'000U - 100'000U);
  EXPECT_EQ(schedule_vertices(mesh, topology).sites.size(), 100'001U);
}

TEST(Renumbering, IsTheSameMeshUnderOtherNumbers) {
  for (const auto& [name, mesh, manifold, closed, degenerate] : mesh_family()) {
    const Renumbering renumbering(mesh);
    ASSERT_EQ(renumbering.mesh.positions.size(), mesh.positions.size()) << name;
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
      EXPECT_EQ(renumbering.mesh.positions[renumbering.new_vertex[v]], mesh.positions[v]) << name;
    }
    for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_EQ(renumbering.mesh.triangles[renumbering.new_face[f]][k], renumbering.new_vertex[mesh.triangles[f][k]]);
      }
    }
    const Topology topology = build_topology(mesh), built = build_topology(renumbering.mesh);
    const RenumberedTopology renumbered(renumbering, topology);
    for (std::size_t e = 0; e < topology.edges.size(); ++e) {
      const auto [low, high] =
          std::minmax(renumbering.new_vertex[topology.edges[e].v0], renumbering.new_vertex[topology.edges[e].v1]);
      EXPECT_EQ(renumbered.topology.edges[renumbered.new_edge[e]], (Edge{low, high})) << name;
      EXPECT_EQ(renumbered.topology.edge_twisted[renumbered.new_edge[e]], topology.edge_twisted[e]) << name;
    }
    EXPECT_EQ(renumbered.topology.edges, built.edges) << name;
    EXPECT_EQ(renumbered.topology.edge_faces, built.edge_faces) << name;
    EXPECT_EQ(renumbered.topology.edge_face_count, built.edge_face_count) << name;
    EXPECT_EQ(renumbered.topology.face_edges, built.face_edges) << name;
    EXPECT_EQ(renumbered.topology.vertex_faces.items, built.vertex_faces.items) << name;
    EXPECT_EQ(renumbered.topology.vertex_edges.items, built.vertex_edges.items) << name;
    for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
      EXPECT_EQ(renumbered.topology.flipped[renumbering.new_face[f]], topology.flipped[f]) << name;
    }
  }
}

}  // namespace
}  // namespace crease
