#include "core/graduated/flat_mesh.h"

#include <algorithm>
#include <cmath>

namespace crease {
namespace {

/// Rows from pairs (row, item), which `visit` hands to its argument in the same order each time it is called.
template <typename Visit>
IndexRows rows_of(std::size_t count, Visit visit) {
  IndexRows rows;
  rows.starts.assign(count + 1, 0);
  visit([&](FlatIndex row, FlatIndex /*item*/) { ++rows.starts[static_cast<std::size_t>(row) + 1]; });
  for (std::size_t row = 0; row < count; ++row) rows.starts[row + 1] += rows.starts[row];
  rows.items.resize(rows.starts.back());
  std::vector<Index> next(rows.starts.begin(), rows.starts.end() - 1);
  visit([&](FlatIndex row, FlatIndex item) {
    rows.items[next[static_cast<std::size_t>(row)]++] = static_cast<Index>(item);
  });
  return rows;
}

Vec3 mean_of(const std::vector<Vec3>& positions) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& position : positions) sum += position;
  return sum / static_cast<double>(positions.size());
}

/// The edge of the topology from corner k to k + 1 of an oriented face.
Index side_of(const Topology& topology, const Triangle& face, std::size_t f, std::size_t k) {
  const Index a = std::min(face[k], face[(k + 1) % 3]), b = std::max(face[k], face[(k + 1) % 3]);
  for (const Index edge : topology.face_edges[f]) {
    if (edge != kNone && topology.edges[edge] == Edge{a, b}) return edge;
  }
  return kNone;
}

Index opposite_corner(const Triangle& face, const Edge& edge) {
  const auto corner = std::ranges::find_if(face, [&](Index v) { return v != edge.v0 && v != edge.v1; });
  return corner == face.end() ? edge.v0 : *corner;
}

}  // namespace

FlatMesh::FlatMesh(const Topology& topology, const std::vector<Triangle>& faces, const std::vector<Vec3>& positions,
                   ThreadTeam& team)
    : vertex_count(positions.size()), face_count(faces.size()) {
  put_edges(topology, faces, team);
  put_faces(topology, faces, team);
  list_by_vertex(team);
  measured.resize(3 * vertex_count);
  const Vec3 center = mean_of(positions);
  for_each(vertex_count, team, [&](std::size_t v) {
    const Vec3 position = positions[v] - center;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      measured[axis * vertex_count + v] = static_cast<float>(position[static_cast<Eigen::Index>(axis)]);
    }
  });
}

void FlatMesh::put_edges(const Topology& topology, const std::vector<Triangle>& faces, ThreadTeam& team) {
  at_border.assign(vertex_count, 0);
  topology_edges.reserve(topology.edges.size());
  for (std::size_t e = 0; e < topology.edges.size(); ++e) {
    if (topology.is_interior(e)) {
      topology_edges.push_back(static_cast<Index>(e));
    } else {
      at_border[topology.edges[e].v0] = at_border[topology.edges[e].v1] = 1;
    }
  }
  edge_count = topology_edges.size();
  for (auto* of_sides : {&edge_ends, &edge_faces, &edge_opposites}) {
    for (auto& of_side : *of_sides) of_side.resize(edge_count);
  }
  for_each(edge_count, team, [&](std::size_t e) {
    const Edge& edge = topology.edges[topology_edges[e]];
    edge_ends[0][e] = static_cast<FlatIndex>(edge.v0);
    edge_ends[1][e] = static_cast<FlatIndex>(edge.v1);
    for (std::size_t side = 0; side < 2; ++side) {
      const Index face = topology.edge_faces[topology_edges[e]][side];
      edge_faces[side][e] = static_cast<FlatIndex>(face);
      edge_opposites[side][e] = static_cast<FlatIndex>(opposite_corner(faces[face], edge));
    }
  });
}

void FlatMesh::put_faces(const Topology& topology, const std::vector<Triangle>& faces, ThreadTeam& team) {
  std::vector<Index> flat_edge(topology.edges.size(), kNone);
  for_each(edge_count, team, [&](std::size_t e) { flat_edge[topology_edges[e]] = static_cast<Index>(e); });
  for (auto* of_corners : {&corners, &neighbors, &sides}) {
    for (auto& of_corner : *of_corners) of_corner.resize(face_count);
  }
  for_each(face_count, team, [&](std::size_t f) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Index edge = side_of(topology, faces[f], f, k);
      const Index across = topology.face_across(static_cast<Index>(f), edge);
      corners[k][f] = static_cast<FlatIndex>(faces[f][k]);
      neighbors[k][f] = static_cast<FlatIndex>(across == kNone ? f : across);
      sides[k][f] = static_cast<FlatIndex>(across == kNone ? edge_count : flat_edge[edge]);
    }
  });
}

void FlatMesh::list_by_vertex(ThreadTeam& team) {
  const auto cut_tiles = [&] { tiles = FaceTiles(vertex_count, face_count, corners, neighbors); };
  const auto list_corners = [&] {
    vertex_corners = rows_of(vertex_count, [&](auto add) {
      for (std::size_t f = 0; f < face_count; ++f) {
        for (std::size_t k = 0; k < 3; ++k) add(corners[k][f], static_cast<FlatIndex>(3 * f + k));
      }
    });
  };
  const auto list_neighbors = [&] {
    vertex_neighbors = rows_of(vertex_count, [&](auto add) {
      for (std::size_t e = 0; e < edge_count; ++e) {
        add(edge_ends[0][e], edge_ends[1][e]);
        add(edge_ends[1][e], edge_ends[0][e]);
      }
    });
  };
  const auto list_stencils = [&] {
    vertex_stencils = rows_of(vertex_count, [&](auto add) {
      for (std::size_t e = 0; e < edge_count; ++e) {
        for (const auto* vertices : {&edge_ends, &edge_opposites}) {
          for (const auto& side : *vertices) add(side[e], static_cast<FlatIndex>(e));
        }
      }
    });
  };
  run_together(team, list_stencils, list_corners, list_neighbors, cut_tiles);
}

void FlatMesh::diffuse(std::vector<float>& values, int rounds) const {
  std::vector<float> before;
  for (int round = 0; round < rounds; ++round) {
    before = values;
    for (std::size_t v = 0; v < vertex_count; ++v) {
      float sum = before[v];
      for (const Index other : vertex_neighbors[v]) sum += before[other];
      values[v] = sum / static_cast<float>(vertex_neighbors[v].size() + 1);
    }
  }
}

std::vector<float> dihedral_angles(const FlatMesh& mesh, std::span<const float> positions, ThreadTeam& team) {
  std::vector<Vec3> normals(mesh.face_count);
  for_each(mesh.face_count, team, [&](std::size_t f) {
    const auto corner = [&](std::size_t k) {
      const auto at = vector_at(positions, static_cast<std::size_t>(mesh.corners[k][f]));
      return Vec3(static_cast<double>(at[0]), static_cast<double>(at[1]), static_cast<double>(at[2]));
    };
    normals[f] = direction(area_vector(corner(0), corner(1), corner(2)));
  });
  std::vector<float> angles(mesh.edge_count);
  for_each(mesh.edge_count, team, [&](std::size_t e) {
    const auto normal = [&](std::size_t side) { return normals[static_cast<std::size_t>(mesh.edge_faces[side][e])]; };
    angles[e] = static_cast<float>(std::acos(std::clamp(normal(0).dot(normal(1)), -1.0, 1.0)));
  });
  return angles;
}

std::vector<float> products(std::span<const float> a, std::span<const float> b) {
  const std::size_t count = a.size() / 3;
  std::vector<float> result(count);
  for (std::size_t v = 0; v < count; ++v) {
    result[v] = a[v] * b[v] + a[count + v] * b[count + v] + a[2 * count + v] * b[2 * count + v];
  }
  return result;
}

FlatVectors difference(std::span<const float> a, std::span<const float> b) {
  FlatVectors result(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) result[i] = a[i] - b[i];
  return result;
}

}  // namespace crease
