#include "core/regression/normal_regression.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/graduated/fast_math.h"
#include "core/regression/layers.h"

namespace crease {
namespace {

constexpr std::size_t kLanes = NormalFeatures::kFaces;
constexpr float kFloor = 1e-3F;     ///< lengths count from here on
constexpr float kSteepestTurn = 1;  ///< tangent of the largest turn

CREASE_LANES_INLINE Lanes log_length(const Lanes& x, const Lanes& y) { return fast_log(kFloor + sqrt(x * x + y * y)); }

struct alignas(32) Turns {
  Lanes x, y;  ///< tangents, along the axes of the faces' planes
};

/// The averaged normals of eight faces, within their planes, and the scalars.
struct Seen {
  LaneArray<NormalFeatures::kVectors> x, y;
  LaneArray<NormalFeatures::kScalars> scalars;
};

CREASE_LANES_INLINE Turns turns_of(const NormalNetwork& network, const Seen& seen) {
  constexpr std::size_t kVectors = NormalFeatures::kVectors, kMixtures = NormalNetwork::kMixtures;
  LaneArray<kMixtures> x, y;
  apply(network.mixing, {}, seen.x, x);
  apply(network.mixing, {}, seen.y, y);
  LaneArray<NormalNetwork::kInputs> in;
  for (std::size_t k = 0; k < kMixtures; ++k) in[k] = log_length(x[k], y[k]);
  for (std::size_t k = 0; k < kVectors; ++k) in[kMixtures + k] = log_length(seen.x[k], seen.y[k]);
  for (std::size_t k = 0; k < NormalFeatures::kScalars; ++k) in[kMixtures + kVectors + k] = seen.scalars[k];
  LaneArray<NormalNetwork::kHidden> first, second;
  apply(network.first, network.first_bias, in, first);
  rectify(first);
  apply(network.second, network.second_bias, first, second);
  rectify(second);
  LaneArray<NormalNetwork::kFactors> factors;
  apply(network.third, network.third_bias, second, factors);
  Turns sum{};
  for (std::size_t k = 0; k < kMixtures; ++k) {
    sum.x += factors[k] * x[k];
    sum.y += factors[k] * y[k];
  }
  for (std::size_t k = 0; k < kVectors; ++k) {
    sum.x += factors[kMixtures + k] * seen.x[k];
    sum.y += factors[kMixtures + k] * seen.y[k];
  }
  return sum;
}

CREASE_WIDE_CLONES void find_turns(const NormalNetwork& network, const NormalFeatures* blocks, Turns* turns,
                                   std::size_t count) {
  for (std::size_t b = 0; b < count; ++b) {
    Seen seen;
    for (std::size_t k = 0; k < NormalFeatures::kVectors; ++k) {
      seen.x[k] = blocks[b].x[k].load();
      seen.y[k] = blocks[b].y[k].load();
    }
    for (std::size_t k = 0; k < NormalFeatures::kScalars; ++k) seen.scalars[k] = blocks[b].scalars[k].load();
    turns[b] = turns_of(network, seen);
  }
}

}  // namespace

FlatVectors regressed_normals(const NormalNetwork& network, const FlatMesh& mesh, std::span<const float> positions,
                              std::span<const float> reference, const DescentSight& sight, float amount,
                              ThreadTeam& team) {
  const std::size_t faces = mesh.face_count;
  const std::vector<NormalFeatures> features = normal_features(mesh, positions, reference, sight, team);
  std::vector<Turns> turns(features.size());
  FlatVectors normals(3 * faces);
  constexpr std::size_t kBlocksATime = 64;
  team.run(features.size(), kBlocksATime, [&](std::size_t begin, std::size_t end, std::size_t) {
    find_turns(network, features.data() + begin, turns.data() + begin, end - begin);
    for (std::size_t f = kLanes * begin; f < std::min(faces, kLanes * end); ++f) {
      const FaceFrame frame = face_frame(mesh, positions, f);
      const Turns& turn = turns[f / kLanes];
      const float x = turn.x[f % kLanes], y = turn.y[f % kLanes], steepness = std::sqrt(x * x + y * y);
      const float share = amount * std::min(1.0F, kSteepestTurn / std::max(steepness, kFloor));
      std::array<float, 3> n{};
      float squares = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        n[axis] = frame.normal[axis] + share * (x * frame.first[axis] + y * frame.second[axis]);
        squares += n[axis] * n[axis];
      }
      const bool has_normal = frame.normal != std::array<float, 3>{} && std::isfinite(squares);
      const float inverse = has_normal ? 1 / std::sqrt(squares) : 0;
      for (float& part : n) part = has_normal ? part * inverse : 0;
      set_vector(normals, f, n);
    }
  });
  return normals;
}

}  // namespace crease
