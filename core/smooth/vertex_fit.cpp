#include "core/smooth/vertex_fit.h"

namespace crease {

void fit_vertices(Field& field, std::uint32_t steps, ThreadTeam& team) {
  constexpr std::size_t kChunk = 2048;
  std::vector<Vec3> centroids(field.faces.size()), next(field.positions);
  for (std::uint32_t step = 0; step < steps; ++step) {
    team.run(centroids.size(), kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
      for (std::size_t f = begin; f < end; ++f) {
        const auto [a, b, c] = field.faces[f];
        centroids[f] = (field.positions[a] + field.positions[b] + field.positions[c]) / 3;
      }
    });
    team.run(next.size(), kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
      for (std::size_t v = begin; v < end; ++v) {
        const auto faces = field.topology.vertex_faces[v];
        if (faces.empty()) continue;
        Vec3 sum = Vec3::Zero();
        for (const Index f : faces) {
          const Vec3 normal = field.normals[f].head<3>().cast<double>();
          sum += normal.dot(centroids[f] - field.positions[v]) * normal;
        }
        next[v] = field.positions[v] + sum / static_cast<double>(faces.size());
      }
    });
    field.positions.swap(next);
  }
}

}  // namespace crease
