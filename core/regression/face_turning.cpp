#include "core/regression/face_turning.h"

#include <algorithm>
#include <cmath>

#include "core/graduated/energy.h"
#include "core/graduated/lbfgs.h"

namespace crease {
namespace {

constexpr float kAnchor = 0.4F;        ///< A; holds waves of ten edges and more
constexpr float kFadingArea = 0.002F;  ///< where tiny faces would rather grow than turn, if it were larger
constexpr float kFoldArea = 0.3F, kLargestArea = 0.9F;
constexpr int kSteps = 10;

/// Faces must keep a share of their area, seen from where they are to look.
std::vector<float> least_areas(const FlatMesh& mesh, std::span<const float> positions) {
  std::vector<float> areas(kLaneCount * mesh.face_blocks(), 0);
  for (std::size_t f = 0; f < mesh.face_count; ++f) {
    const auto [x, y, z] = area_vector(mesh, positions, f);
    areas[f] = kFoldArea * std::min(kLargestArea, std::sqrt(x * x + y * y + z * z));
  }
  return areas;
}

}  // namespace

FlatVectors turned_towards(const FlatMesh& mesh, const FlatVectors& positions, const FlatVectors& normals,
                           std::span<const float> precisions, ThreadTeam& team) {
  GraduatedEnergy energy(mesh, positions);
  energy.exponent = 2;
  energy.likelihood = kAnchor;
  energy.fading_area = kFadingArea;
  energy.least_areas = least_areas(mesh, positions);
  for (std::size_t f = 0; f < mesh.face_count; ++f) set_vector(energy.face_references, f, vector_at(normals, f));
  energy.face_targets = energy.face_references;
  if (!precisions.empty()) energy.precisions.assign(precisions.begin(), precisions.end());
  FlatVectors result = positions;
  std::vector<float> curvatures;
  LbfgsOptions search;
  search.steps = kSteps;
  search.diagonal = &curvatures;
  search.on_start = [&] { curvatures = energy.inverse_curvatures(result, team); };
  LbfgsMemory memory;
  minimize([&](std::span<const float> x, std::span<float> gradient) { return energy(x, gradient, team); }, result,
           search, team, memory);
  return result;
}

}  // namespace crease
