#include "core/solve/schedule.h"

#include <algorithm>
#include <bit>
#include <numeric>

namespace crease {
namespace {

/// Enough blocks to keep many threads busy, each large enough to be worth a task; fixed by the mesh alone.
std::size_t block_size(std::size_t vertices) { return std::clamp<std::size_t>(vertices / 128, 32, 512); }

Index opposite_vertex(const Triangle& triangle, const Edge& edge) {
  for (const Index v : triangle) {
    if (v != edge.v0 && v != edge.v1) return v;
  }
  return edge.v0;
}

/// Calls `visit` for the first-order neighbours of `vertex` and for itself, some of them more than once.
template <typename Visit>
void visit_near(const Mesh& mesh, const Topology& topology, Index vertex, Visit visit) {
  for (const Index face : topology.vertex_faces[vertex]) {
    for (const Index v : mesh.triangles[face]) visit(v);
    for (const Index edge : topology.face_edges[face]) {
      if (edge == kNone || !topology.is_interior(edge)) continue;
      for (const Index f : topology.edge_faces[edge]) visit(opposite_vertex(mesh.triangles[f], topology.edges[edge]));
    }
  }
}

/// Calls `visit` for the neighbours of `vertex` and for itself, some of them more than once.
template <typename Visit>
void visit_neighbors(const Mesh& mesh, const Topology& topology, Neighborhood neighborhood, Index vertex, Visit visit) {
  if (neighborhood == Neighborhood::kFirstOrder) {
    visit_near(mesh, topology, vertex, visit);
    return;
  }
  for (const Index face : topology.vertex_faces[vertex]) {
    for (const Index v : mesh.triangles[face]) visit_near(mesh, topology, v, visit);
  }
}

/// Greedy coloring: neighbours differ. kNone for vertices without faces.
std::vector<Index> color_vertices(const Mesh& mesh, const Topology& topology, Neighborhood neighborhood) {
  std::vector<Index> colors(mesh.positions.size(), kNone);
  std::vector<Index> last_seen_by;  // per colour: the vertex that last saw it on a neighbour
  for (Index vertex = 0; vertex < colors.size(); ++vertex) {
    if (topology.vertex_faces[vertex].empty()) continue;
    visit_neighbors(mesh, topology, neighborhood, vertex, [&](Index neighbor) {
      if (colors[neighbor] != kNone) last_seen_by[colors[neighbor]] = vertex;
    });
    const auto free = std::ranges::find_if(last_seen_by, [&](Index seer) { return seer != vertex; });
    colors[vertex] = static_cast<Index>(free - last_seen_by.begin());
    if (free == last_seen_by.end()) last_seen_by.push_back(kNone);
  }
  return colors;
}

/// The sites of each block, and the blocks in phases: blocks of a phase touch no vertex in common. `visit_touched`
/// names every vertex that a site reads or writes at. A vertex knows 64 phases; blocks beyond them get phases of their
/// own.
template <typename VisitTouched>
std::vector<std::size_t> assign_phases(const std::vector<std::vector<Index>>& blocks, std::size_t vertices,
                                       VisitTouched visit_touched) {
  constexpr std::size_t kKnown = 64;
  std::vector<std::uint64_t> taken(vertices, 0);
  std::vector<std::size_t> phase_of(blocks.size(), 0);
  std::size_t own_phase = kKnown;
  for (std::size_t block = 0; block < blocks.size(); ++block) {
    std::uint64_t unusable = 0;
    for (const Index site : blocks[block]) visit_touched(site, [&](Index vertex) { unusable |= taken[vertex]; });
    const auto phase = static_cast<std::size_t>(std::countr_one(unusable));
    phase_of[block] = phase < kKnown ? phase : own_phase++;
    if (phase == kKnown) continue;
    const std::uint64_t mark = std::uint64_t{1} << phase;
    for (const Index site : blocks[block]) visit_touched(site, [&](Index vertex) { taken[vertex] |= mark; });
  }
  return phase_of;
}

/// Blocks in the order of their phases become tasks; within a block a run ends where `starts_run` says so.
template <typename StartsRun>
Schedule lay_out(const std::vector<std::vector<Index>>& blocks, const std::vector<std::size_t>& phase_of,
                 StartsRun starts_run) {
  std::vector<std::size_t> order(blocks.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return phase_of[a] < phase_of[b]; });

  Schedule schedule;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::vector<Index>& block = blocks[order[i]];
    if (i == 0 || phase_of[order[i]] != phase_of[order[i - 1]]) schedule.phases.push_back(schedule.tasks.size());
    schedule.tasks.push_back(schedule.runs.size());
    for (std::size_t k = 0; k < block.size(); ++k) {
      if (k == 0 || starts_run(block[k - 1], block[k])) schedule.runs.push_back(schedule.sites.size());
      schedule.sites.push_back(block[k]);
    }
  }
  schedule.phases.push_back(schedule.tasks.size());
  schedule.tasks.push_back(schedule.runs.size());
  schedule.runs.push_back(schedule.sites.size());
  return schedule;
}

std::vector<std::vector<Index>> without_empty(std::vector<std::vector<Index>> blocks) {
  std::erase_if(blocks, [](const std::vector<Index>& block) { return block.empty(); });
  return blocks;
}

}  // namespace

Schedule schedule_vertices(const Mesh& mesh, const Topology& topology, Neighborhood neighborhood) {
  const std::vector<Index> colors = color_vertices(mesh, topology, neighborhood);
  const std::size_t size = block_size(colors.size());
  std::vector<std::vector<Index>> blocks(colors.size() / size + 1);
  for (Index vertex = 0; vertex < colors.size(); ++vertex) {
    if (colors[vertex] != kNone) blocks[vertex / size].push_back(vertex);
  }
  blocks = without_empty(std::move(blocks));
  // Within a run by the number of faces, so that one visit branches as the last one did.
  for (std::vector<Index>& block : blocks) {
    std::ranges::stable_sort(
        block, {}, [&](Index vertex) { return std::pair(colors[vertex], topology.vertex_faces[vertex].size()); });
  }
  const std::vector<std::size_t> phase_of = assign_phases(blocks, colors.size(), [&](Index vertex, auto&& visit) {
    if (neighborhood == Neighborhood::kWide) {
      visit_neighbors(mesh, topology, neighborhood, vertex, visit);
      return;
    }
    for (const Index face : topology.vertex_faces[vertex]) {
      for (const Index touched : mesh.triangles[face]) visit(touched);
    }
  });
  return lay_out(blocks, phase_of, [&](Index before, Index next) { return colors[before] != colors[next]; });
}

Schedule schedule_faces(const Mesh& mesh) {
  const std::size_t size = block_size(mesh.positions.size());
  std::vector<std::vector<Index>> blocks(mesh.positions.size() / size + 1);
  for (Index face = 0; face < mesh.triangles.size(); ++face) {
    blocks[std::ranges::min(mesh.triangles[face]) / size].push_back(face);
  }
  blocks = without_empty(std::move(blocks));
  const std::vector<std::size_t> phase_of = assign_phases(blocks, mesh.positions.size(), [&](Index face, auto&& visit) {
    for (const Index vertex : mesh.triangles[face]) visit(vertex);
  });
  return lay_out(blocks, phase_of, [](Index, Index) { return false; });
}

Schedule schedule_edges(const Topology& topology) {
  const std::size_t vertices = topology.vertex_edges.size();
  const std::size_t size = block_size(vertices);
  std::vector<std::vector<Index>> blocks(vertices / size + 1);
  for (Index edge = 0; edge < topology.edges.size(); ++edge) {
    if (topology.is_interior(edge)) blocks[topology.edges[edge].v0 / size].push_back(edge);
  }
  blocks = without_empty(std::move(blocks));
  const std::vector<std::size_t> phase_of = assign_phases(blocks, vertices, [&](Index edge, auto&& visit) {
    visit(topology.edges[edge].v0);
    visit(topology.edges[edge].v1);
  });
  return lay_out(blocks, phase_of, [](Index, Index) { return false; });
}

}  // namespace crease
