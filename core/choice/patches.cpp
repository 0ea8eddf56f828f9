#include "core/choice/patches.h"

#include <utility>

namespace crease {
namespace {

constexpr std::size_t kPatches = 4;

/// Faces in the order in which they are reached from evenly spaced ones, breadth first.
std::vector<std::uint8_t> choose_faces(const Surface& surface, std::size_t wanted) {
  const std::size_t count = surface.faces.size();
  std::vector<std::uint8_t> chosen(count, 0);
  std::size_t total = 0;
  for (std::size_t patch = 0; patch < kPatches; ++patch) {
    std::size_t seed = (2 * patch + 1) * count / (2 * kPatches);
    while (seed < count && chosen[seed] != 0) ++seed;
    if (seed == count) continue;
    std::vector<Index> queue;
    const auto choose = [&](Index face) {
      if (chosen[face] != 0 || total >= wanted * (patch + 1) / kPatches) return;
      chosen[face] = 1;
      queue.push_back(face);
      ++total;
    };
    choose(static_cast<Index>(seed));
    for (std::size_t i = 0; i < queue.size(); ++i) surface.visit_face_neighbors(queue[i], choose);
  }
  return chosen;
}

}  // namespace

Patches cut_patches(const Surface& surface, std::size_t faces) {
  const std::vector<std::uint8_t> chosen = choose_faces(surface, faces);
  Patches patches;
  std::vector<Index> number(surface.measured.size(), kNone);
  for (std::size_t f = 0; f < chosen.size(); ++f) {
    if (chosen[f] == 0) continue;
    Triangle triangle{};
    for (std::size_t k = 0; k < 3; ++k) {
      Index& place = number[surface.faces[f][k]];
      if (place == kNone) {
        place = static_cast<Index>(patches.vertices.size());
        patches.vertices.push_back(surface.faces[f][k]);
        patches.mesh.positions.push_back(surface.measured[surface.faces[f][k]]);
      }
      triangle[k] = place;
    }
    patches.mesh.triangles.push_back(triangle);
  }
  return patches;
}

std::optional<TrialPatches> cut_for_trials(const Surface& surface, std::span<const float> precisions) {
  constexpr std::size_t kMostFaces = 24'000, kPatchFaces = 12'000;
  if (surface.faces.size() <= kMostFaces) return std::nullopt;
  Patches patches = cut_patches(surface, kPatchFaces);
  FlatMesh mesh(build_topology(patches.mesh), patches.mesh.triangles, patches.mesh.positions);
  TrialPatches trial{std::move(patches), std::move(mesh), {}};
  if (precisions.empty()) return trial;
  for (const Index v : trial.patches.vertices) trial.precisions.push_back(precisions[v]);
  return trial;
}

}  // namespace crease
