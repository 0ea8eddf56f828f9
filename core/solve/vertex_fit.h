#pragma once

#include <cstdint>
#include <vector>

#include "core/base/thread_team.h"
#include "core/geometry/surface.h"

namespace crease {

/// Moves vertices until the faces look along `normals`, in the least-squares sense: `steps` steps down the gradient of
/// Σ (n_f · (v_i − v_j))² over the sides of all faces [Taubin 2001; Shen & Barner 2004], each as long as is safe
/// [Sun et al. 2007]. `normal(face)` is a unit normal in double precision, `moves(vertex)` whether a vertex may move.
template <typename Normal, typename Moves>
void fit_vertices(Surface& surface, std::uint32_t steps, Normal normal, Moves moves, ThreadTeam& team) {
  std::vector<Vec3> centroids(surface.faces.size()), next(surface.positions);
  for (std::uint32_t step = 0; step < steps; ++step) {
    team.run(centroids.size(), kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
      for (std::size_t f = begin; f < end; ++f) centroids[f] = surface.centroid(f);
    });
    team.run(next.size(), kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
      for (std::size_t v = begin; v < end; ++v) {
        const auto faces = surface.topology.vertex_faces[v];
        if (faces.empty() || !moves(v)) continue;
        Vec3 sum = Vec3::Zero();
        for (const Index f : faces) {
          const Vec3& n = normal(f);
          sum += n.dot(centroids[f] - surface.positions[v]) * n;
        }
        next[v] = surface.positions[v] + sum / static_cast<double>(faces.size());
      }
    });
    surface.positions.swap(next);
  }
}

}  // namespace crease
