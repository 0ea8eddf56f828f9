#include "core/mesh/input_facts.h"

#include <fmt/format.h>

#include <cmath>

#include "core/mesh/noise_estimate.h"

namespace crease {
namespace {

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

/// A degenerate face with corners a, b, a names its edge twice.
bool is_of_one_face(const Topology& topology, std::size_t edge) {
  return topology.edge_faces[edge][0] == topology.edge_faces[edge][1];
}

/// What a warning is about, with its verb.
struct Subject {
  std::string_view one, many;
};

/// Adds warnings that name elements of the upload.
class Warner {
 public:
  Warner(const Topology& topology, const WeldedMesh* welded, std::vector<Warning>& warnings)
      : topology_(topology), welded_(welded), warnings_(warnings) {}

  std::uint32_t edges(const Tally& found, std::string_view code, const Subject& subject, std::string_view meaning) {
    if (found.count == 0) return 0;
    const auto [v0, v1] = topology_.edges[found.first];
    return add(found, code, subject, meaning,
               fmt::format("between vertices {} and {}", upload_vertex(v0), upload_vertex(v1)));
  }
  std::uint32_t faces(const Tally& found, std::string_view code, const Subject& subject, std::string_view meaning) {
    return add(found, code, subject, meaning, fmt::format("face {}", found.first));
  }
  std::uint32_t vertices(const Tally& found, std::string_view code, const Subject& subject, std::string_view meaning) {
    return add(found, code, subject, meaning, fmt::format("vertex {}", found.first));
  }

 private:
  Index upload_vertex(Index vertex) const { return welded_ == nullptr ? vertex : welded_->upload_vertex[vertex]; }

  std::uint32_t add(const Tally& found, std::string_view code, const Subject& subject, std::string_view meaning,
                    const std::string& first) {
    if (found.count == 0) return 0;
    const std::string_view about = found.count == 1 ? subject.one : subject.many;
    warnings_.push_back(
        {std::string(code), fmt::format("{} {} {}; the first is {}", found.count, about, meaning, first)});
    return found.count;
  }

  const Topology& topology_;
  const WeldedMesh* welded_;
  std::vector<Warning>& warnings_;
};

Tally tally_isolated(const Mesh& upload, const Topology& topology, const WeldedMesh* welded) {
  return tally(upload.positions.size(), [&](std::size_t vertex) {
    const Index smoothed = welded == nullptr ? static_cast<Index>(vertex) : welded->vertex_of[vertex];
    return smoothed == kNone || topology.vertex_faces[smoothed].empty();
  });
}

Tally tally_flipped(const Topology& topology, const WeldedMesh* welded) {
  Tally flipped = tally(topology.flipped.size(), [&](std::size_t face) { return topology.flipped[face] != 0; });
  if (welded != nullptr && flipped.count > 0) flipped.first = welded->upload_face[flipped.first];
  return flipped;
}

}  // namespace

void require_faces_and_numbers(const Mesh& mesh) {
  if (mesh.triangles.empty()) throw Error(code::kMeshNoFaces, "the mesh has no faces");
  require_finite(mesh);
}

InputFacts inspect(const Mesh& upload, const Topology& upload_topology, const WeldedMesh* welded,
                   const WeldFacts& found, std::vector<Warning>& warnings, ThreadTeam& team) {
  const Mesh& mesh = welded == nullptr ? upload : welded->mesh;
  const Topology& topology = welded == nullptr ? upload_topology : welded->topology;
  InputFacts facts;
  facts.mean_edge_length = require_extent(mesh, topology);
  facts.vertices = static_cast<std::uint32_t>(upload.positions.size());
  facts.faces = static_cast<std::uint32_t>(upload.triangles.size());
  facts.edges = static_cast<std::uint32_t>(topology.edges.size());
  facts.components = static_cast<std::uint32_t>(find_components(mesh).count);
  const auto& face_count = topology.edge_face_count;
  facts.boundary_edges = tally(facts.edges, [&](std::size_t e) { return face_count[e] == 1; }).count;

  const Tally crowded = tally(facts.edges, [&](std::size_t e) { return face_count[e] > 2; });
  const Tally twisted = tally(facts.edges, [&](std::size_t e) {
    return face_count[e] == 2 && topology.edge_twisted[e] != 0 && !is_of_one_face(topology, e);
  });

  Warner warn(topology, welded, warnings);
  facts.coincident_vertices = warn.vertices(found.coincident_vertices, "vertices_welded", {"vertex is", "vertices are"},
                                            "exactly where an earlier one is: smoothed as one, returned as given");
  facts.nonmanifold_edges = warn.edges(crowded, "nonmanifold_edges", {"edge has", "edges have"},
                                       "more than two faces, across which nothing is smoothed");
  warn.edges(twisted, "twisted_edges", {"edge joins", "edges join"},
             "faces that cannot be wound alike: nothing is smoothed there");
  facts.degenerate_faces = warn.faces(found.degenerate_faces, "degenerate_faces", {"face has", "faces have"},
                                      "no area and so no normal to smooth: left out, returned as given");
  facts.duplicate_faces = warn.faces(found.duplicate_faces, "duplicate_faces", {"face has", "faces have"},
                                     "the same vertices as an earlier one: smoothed as one, returned as given");
  facts.isolated_vertices = warn.vertices(tally_isolated(upload, topology, welded), "isolated_vertices",
                                          {"vertex is", "vertices are"}, "in no face: returned as given");
  facts.flipped_faces = warn.faces(tally_flipped(topology, welded), "inconsistent_winding", {"face is", "faces are"},
                                   "wound against the neighbours: smoothed as if turned, returned as given");
  facts.noise_sigma = estimate_noise_sigma(mesh, topology, team);
  return facts;
}

}  // namespace crease
