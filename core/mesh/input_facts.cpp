#include "core/mesh/input_facts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/mesh/noise_estimate.h"

namespace crease {
namespace {

/// How many there are of a kind, and which is the first.
struct Tally {
  std::uint32_t count = 0;
  std::size_t first = 0;

  void add(std::size_t index) {
    if (count == 0 || index < first) first = index;
    ++count;
  }
};

template <typename Holds>
Tally tally(std::size_t size, Holds holds) {
  Tally result;
  for (std::size_t i = 0; i < size; ++i) {
    if (holds(i)) result.add(i);
  }
  return result;
}

void require_finite(const Mesh& mesh) {
  for (std::size_t vertex = 0; vertex < mesh.positions.size(); ++vertex) {
    const Vec3& p = mesh.positions[vertex];
    if (p.allFinite()) continue;
    throw Error(code::kMeshNotFinite, fmt::format("vertex {} is at ({}, {}, {})", vertex, p.x(), p.y(), p.z()),
                fmt::format("vertex {}", vertex));
  }
}

double require_extent(const Mesh& mesh, const Topology& topology) {
  const double length = mean_edge_length(mesh.positions, topology.edges);
  if (!std::isfinite(length * length)) {
    throw Error(code::kMeshNotFinite, "the mesh is so large that its areas are not finite numbers");
  }
  if (!(length * length > 0)) {
    throw Error(code::kMeshNoExtent, length > 0 ? "the mesh is so small that its areas vanish in double precision"
                                                : "all edges have length zero");
  }
  return length;
}

Tally tally_duplicates(const Mesh& mesh) {
  std::vector<Triangle> corners = mesh.triangles;
  for (Triangle& triangle : corners) std::sort(triangle.begin(), triangle.end());
  std::vector<std::uint32_t> order(corners.size());
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return corners[a] != corners[b] ? corners[a] < corners[b] : a < b;
  });
  Tally result;
  for (std::size_t i = 1; i < order.size(); ++i) {
    if (corners[order[i]] == corners[order[i - 1]]) result.add(order[i]);
  }
  return result;
}

/// Of lengths in mean edge lengths, so that small meshes do not lose their areas to underflow.
Tally tally_degenerate(const Mesh& mesh, const Topology& topology, double length_unit) {
  std::vector<Vec3> scaled = mesh.positions;
  for (Vec3& position : scaled) position = (position - mesh.positions.front()) / length_unit;
  const std::vector<Vec3> normals = face_normals(mesh, topology, scaled);
  return tally(normals.size(), [&](std::size_t face) {
    const auto& [a, b, c] = mesh.triangles[face];
    return a == b || b == c || c == a || normals[face].isZero(0);
  });
}

/// A degenerate face with corners a, b, a names its edge twice.
bool is_of_one_face(const Topology& topology, std::size_t edge) {
  return topology.edge_faces[edge][0] == topology.edge_faces[edge][1];
}

class Warner {
 public:
  Warner(const Topology& topology, std::vector<Warning>& warnings) : topology_(topology), warnings_(warnings) {}

  std::uint32_t edges(const Tally& found, std::string_view code, std::string_view meaning) {
    if (found.count == 0) return 0;
    const auto [v0, v1] = topology_.edges[found.first];
    return add(found, code, meaning, fmt::format("between vertices {} and {}", v0, v1));
  }
  std::uint32_t faces(const Tally& found, std::string_view code, std::string_view meaning) {
    return add(found, code, meaning, fmt::format("face {}", found.first));
  }
  std::uint32_t vertices(const Tally& found, std::string_view code, std::string_view meaning) {
    return add(found, code, meaning, fmt::format("vertex {}", found.first));
  }

 private:
  std::uint32_t add(const Tally& found, std::string_view code, std::string_view meaning, const std::string& first) {
    if (found.count == 0) return 0;
    warnings_.push_back({std::string(code), fmt::format("{} {}; the first is {}", found.count, meaning, first)});
    return found.count;
  }

  const Topology& topology_;
  std::vector<Warning>& warnings_;
};

}  // namespace

InputFacts inspect(const Mesh& mesh, const Topology& topology, std::vector<Warning>& warnings) {
  if (mesh.triangles.empty()) throw Error(code::kMeshNoFaces, "the mesh has no faces");
  require_finite(mesh);

  InputFacts facts;
  facts.mean_edge_length = require_extent(mesh, topology);
  facts.vertices = static_cast<std::uint32_t>(mesh.positions.size());
  facts.faces = static_cast<std::uint32_t>(mesh.triangles.size());
  facts.edges = static_cast<std::uint32_t>(topology.edges.size());
  facts.components = static_cast<std::uint32_t>(count_components(mesh));
  const auto& face_count = topology.edge_face_count;
  facts.boundary_edges = tally(facts.edges, [&](std::size_t e) { return face_count[e] == 1; }).count;

  const Tally crowded = tally(facts.edges, [&](std::size_t e) { return face_count[e] > 2; });
  const Tally twisted = tally(facts.edges, [&](std::size_t e) {
    return face_count[e] == 2 && topology.edge_twisted[e] != 0 && !is_of_one_face(topology, e);
  });
  const Tally isolated = tally(facts.vertices, [&](std::size_t v) { return topology.vertex_faces[v].empty(); });
  const Tally flipped = tally(facts.faces, [&](std::size_t f) { return topology.flipped[f] != 0; });

  Warner warn(topology, warnings);
  facts.nonmanifold_edges =
      warn.edges(crowded, "nonmanifold_edges", "edges have more than two faces: nothing is smoothed across them");
  warn.edges(twisted, "twisted_edges", "edges join faces that cannot be wound alike: nothing is smoothed across them");
  facts.degenerate_faces = warn.faces(tally_degenerate(mesh, topology, facts.mean_edge_length), "degenerate_faces",
                                      "faces have no area and so no normal to smooth");
  facts.duplicate_faces =
      warn.faces(tally_duplicates(mesh), "duplicate_faces", "faces have the same vertices as an earlier one");
  facts.isolated_vertices = warn.vertices(isolated, "isolated_vertices", "vertices are in no face and stay in place");
  facts.flipped_faces =
      warn.faces(flipped, "inconsistent_winding",
                 "faces are wound against their neighbours: smoothed as if turned, returned as given");
  facts.noise_sigma = estimate_noise_sigma(mesh, topology);
  return facts;
}

}  // namespace crease
