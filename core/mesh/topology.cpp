#include "core/mesh/topology.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/mesh/face_vectors.h"

namespace crease {
namespace {

struct HalfEdge {
  Index low = 0, high = 0;  ///< its ends
  std::uint32_t place = 0;  ///< 3 * face + corner
};

template <typename Visit>
void visit_half_edges(const Mesh& mesh, Visit visit) {
  for (std::size_t face = 0; face < mesh.triangles.size(); ++face) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const auto [low, high] = std::minmax(mesh.triangles[face][corner], mesh.triangles[face][(corner + 1) % 3]);
      if (low != high) visit(HalfEdge{low, high, static_cast<std::uint32_t>(3 * face + corner)});
    }
  }
}

/// By their ends, the smaller one first, and then by their place.
std::vector<HalfEdge> sorted_half_edges(const Mesh& mesh) {
  std::vector<std::size_t> next(mesh.positions.size() + 1, 0);  // per smaller end: where its half-edges go
  visit_half_edges(mesh, [&](const HalfEdge& h) { ++next[h.low + 1]; });
  std::partial_sum(next.begin(), next.end(), next.begin());
  std::vector<HalfEdge> half_edges(next.back());
  visit_half_edges(mesh, [&](const HalfEdge& h) { half_edges[next[h.low]++] = h; });
  std::size_t begin = 0;
  for (std::size_t v = 0; v + 1 < next.size(); ++v) {
    std::sort(half_edges.begin() + static_cast<std::ptrdiff_t>(begin),
              half_edges.begin() + static_cast<std::ptrdiff_t>(next[v]), [](const HalfEdge& a, const HalfEdge& b) {
                return a.high != b.high ? a.high < b.high : a.place < b.place;
              });
    begin = next[v];
  }
  return half_edges;
}

bool is_same_edge(const HalfEdge& a, const HalfEdge& b) { return a.low == b.low && a.high == b.high; }

/// Numbers the edges in the order of their first half-edge and ties faces and edges together.
void connect_edges(const Mesh& mesh, Topology& topology) {
  const std::vector<HalfEdge> half_edges = sorted_half_edges(mesh);
  std::vector<std::uint32_t> number(3 * mesh.triangles.size(), 0);
  for (std::size_t i = 0; i < half_edges.size(); ++i) {
    if (i == 0 || !is_same_edge(half_edges[i], half_edges[i - 1])) number[half_edges[i].place] = 1;
  }
  std::uint32_t edge_count = 0;
  for (std::uint32_t& n : number) n = n != 0 ? edge_count++ : kNone;

  topology.edges.resize(edge_count);
  topology.edge_faces.assign(edge_count, {kNone, kNone});
  topology.edge_face_count.assign(edge_count, 0);
  topology.edge_twisted.assign(edge_count, 0);
  topology.face_edges.assign(mesh.triangles.size(), {kNone, kNone, kNone});
  Index edge = kNone;
  for (std::size_t i = 0; i < half_edges.size(); ++i) {
    const auto [low, high, place] = half_edges[i];
    if (i == 0 || !is_same_edge(half_edges[i], half_edges[i - 1])) edge = number[place];
    topology.edges[edge] = {low, high};
    const std::uint32_t seen = topology.edge_face_count[edge]++;
    if (seen < 2) topology.edge_faces[edge][seen] = place / 3;
    topology.face_edges[place / 3][place % 3] = edge;
  }
  // A face that names an edge twice (corners a, b, a) is no neighbour of itself.
  for (std::size_t e = 0; e < edge_count; ++e) {
    if (topology.edge_face_count[e] == 2 && topology.edge_faces[e][0] == topology.edge_faces[e][1]) {
      topology.edge_twisted[e] = 1;
    }
  }
}

template <typename Rows, typename Visit>
void fill_rows(IndexRows& result, std::size_t row_count, const Rows& rows, Visit visit) {
  result.starts.assign(row_count + 1, 0);
  for (std::size_t i = 0; i < rows.size(); ++i) visit(rows[i], [&](Index row) { ++result.starts[row + 1]; });
  std::partial_sum(result.starts.begin(), result.starts.end(), result.starts.begin());
  result.items.resize(result.starts.back());
  std::vector<Index> next(result.starts.begin(), result.starts.end() - 1);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    visit(rows[i], [&](Index row) { result.items[next[row]++] = static_cast<Index>(i); });
  }
}

bool runs_forward(const Triangle& triangle, const Edge& edge) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (triangle[k] == edge.v0 && triangle[(k + 1) % 3] == edge.v1) return true;
  }
  return false;
}

/// Turns the faces of each patch so that neighbours across two-faced edges agree, as the larger part is wound.
void orient_faces(const Mesh& mesh, Topology& topology) {
  const std::size_t face_count = mesh.triangles.size();
  topology.flipped.assign(face_count, 0);
  std::vector<std::uint8_t> visited(face_count, 0);
  std::vector<Index> patch;
  for (std::size_t seed = 0; seed < face_count; ++seed) {
    if (visited[seed] != 0) continue;
    visited[seed] = 1;
    patch.assign(1, static_cast<Index>(seed));
    std::size_t flipped_count = 0;
    for (std::size_t next = 0; next < patch.size(); ++next) {
      const Index face = patch[next];
      flipped_count += topology.flipped[face];
      for (const Index edge : topology.face_edges[face]) {
        const Index other = topology.face_across(face, edge);
        if (other == kNone) continue;
        const auto [f0, f1] = topology.edge_faces[edge];
        const bool same_direction = runs_forward(mesh.triangles[f0], topology.edges[edge]) ==
                                    runs_forward(mesh.triangles[f1], topology.edges[edge]);
        const auto wanted = static_cast<std::uint8_t>(topology.flipped[face] ^ (same_direction ? 1 : 0));
        if (visited[other] == 0) {
          visited[other] = 1;
          topology.flipped[other] = wanted;
          patch.push_back(other);
        } else if (topology.flipped[other] != wanted) {
          topology.edge_twisted[edge] = 1;
        }
      }
    }
    if (2 * flipped_count > patch.size()) {
      for (const Index face : patch) topology.flipped[face] ^= 1;
    }
  }
}

}  // namespace

void list_by_vertex(const Mesh& mesh, Topology& topology, ThreadTeam& team) {
  const auto list_faces = [&] {
    fill_rows(topology.vertex_faces, mesh.positions.size(), mesh.triangles, [](const Triangle& t, auto&& add) {
      add(t[0]);
      if (t[1] != t[0]) add(t[1]);
      if (t[2] != t[0] && t[2] != t[1]) add(t[2]);
    });
  };
  const auto list_edges = [&] {
    fill_rows(topology.vertex_edges, mesh.positions.size(), topology.edges, [](const Edge& e, auto&& add) {
      add(e.v0);
      add(e.v1);
    });
  };
  run_together(team, list_faces, list_edges);
}

Topology build_topology(const Mesh& mesh) {
  Topology topology;
  connect_edges(mesh, topology);
  list_by_vertex(mesh, topology);
  orient_faces(mesh, topology);
  return topology;
}

Components find_components(const Mesh& mesh) {
  std::vector<Index> parent(mesh.positions.size());
  std::iota(parent.begin(), parent.end(), Index{0});
  const auto root = [&](Index v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  std::vector<std::uint8_t> used(mesh.positions.size(), 0);
  for (const Triangle& triangle : mesh.triangles) {
    for (const Index v : triangle) {
      used[v] = 1;
      parent[root(v)] = root(triangle[0]);
    }
  }
  Components components{std::vector<Index>(parent.size(), kNone), 0};
  for (Index v = 0; v < parent.size(); ++v) {
    if (used[v] == 0) continue;
    Index& of_root = components.of_vertex[root(v)];
    if (of_root == kNone) of_root = static_cast<Index>(components.count++);
    components.of_vertex[v] = of_root;
  }
  return components;
}

double mean_edge_length(const std::vector<Vec3>& positions, const std::vector<Edge>& edges) {
  if (edges.empty()) return 0;
  double sum = 0;
  for (const Edge& edge : edges) sum += (positions[edge.v0] - positions[edge.v1]).stableNorm();
  return sum / static_cast<double>(edges.size());
}

Triangle oriented(const Mesh& mesh, const Topology& topology, std::size_t face) {
  Triangle triangle = mesh.triangles[face];
  if (topology.flipped[face] != 0) std::swap(triangle[1], triangle[2]);
  return triangle;
}

std::vector<Vec3> face_normals(const Mesh& mesh, const Topology& topology, const std::vector<Vec3>& positions,
                               ThreadTeam& team) {
  std::vector<Vec3> normals(mesh.triangles.size());
  for_each(normals.size(), team, [&](std::size_t face) {
    normals[face] = area_vector(positions, oriented(mesh, topology, face)).stableNormalized();
  });
  return normals;
}

std::vector<double> signed_dihedral_angles(const Mesh& mesh, const Topology& topology,
                                           const std::vector<Vec3>& positions, ThreadTeam& team) {
  const std::vector<Vec3> normals = face_normals(mesh, topology, positions, team);
  std::vector<double> angles(topology.edges.size(), 0);
  for_each(angles.size(), team, [&](std::size_t e) {
    if (!topology.is_interior(e)) return;
    const auto [f0, f1] = topology.edge_faces[e];
    const Edge& edge = topology.edges[e];
    const bool forward = runs_forward(oriented(mesh, topology, f0), edge);
    const Vec3 along =
        forward ? Vec3(positions[edge.v1] - positions[edge.v0]) : Vec3(positions[edge.v0] - positions[edge.v1]);
    const Vec3 cross = normals[f0].cross(normals[f1]);
    angles[e] = std::atan2(std::copysign(cross.norm(), cross.dot(along)), normals[f0].dot(normals[f1]));
  });
  return angles;
}

}  // namespace crease
