#include "core/regression/normal_regression.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/graduated/fast_math.h"
#include "core/regression/normal_network.h"

namespace crease {
namespace {

constexpr std::size_t kLanes = NormalFeatures::kFaces;
constexpr float kFloor = 1e-3F;     ///< lengths count from here on
constexpr float kSteepestTurn = 1;  ///< tangent of the largest turn

CREASE_LANES_INLINE Lanes log_length(const Lanes& x, const Lanes& y) { return fast_log(kFloor + sqrt(x * x + y * y)); }

template <std::size_t outputs, std::size_t inputs>
using Matrix = NormalNetwork::Weights<outputs, inputs>;

/// Outputs `first` to `first + count` of `apply`.
template <std::size_t count, std::size_t outputs, std::size_t inputs>
CREASE_LANES_INLINE void apply_some(const Matrix<outputs, inputs>& weights, const std::array<float, outputs>& bias,
                                    const LaneArray<inputs>& in, LaneArray<outputs>& out, std::size_t first) {
  LaneArray<count> sums{};
  for (std::size_t i = 0; i < inputs; ++i) {
    for (std::size_t k = 0; k < count; ++k) sums[k] += weights[first + k][i] * in[i];
  }
  for (std::size_t k = 0; k < count; ++k) out[first + k] = sums[k] + bias[first + k];
}

/// out_o = bias_o + Σ_i weights[o][i] in_i
template <std::size_t outputs, std::size_t inputs>
CREASE_LANES_INLINE void apply(const Matrix<outputs, inputs>& weights, const std::array<float, outputs>& bias,
                               const LaneArray<inputs>& in, LaneArray<outputs>& out) {
  constexpr std::size_t kAtATime = 8, kRest = outputs % kAtATime;
  for (std::size_t o = 0; o + kAtATime <= outputs; o += kAtATime) apply_some<kAtATime>(weights, bias, in, out, o);
  if constexpr (kRest > 0) apply_some<kRest>(weights, bias, in, out, outputs - kRest);
}

template <std::size_t count>
CREASE_LANES_INLINE void rectify(LaneArray<count>& values) {
  for (Lanes& value : values.items) value = value > 0 ? value : Lanes{};
}

struct alignas(32) Turns {
  Lanes x, y;  ///< tangents, along the axes of the faces' planes
};

CREASE_WIDE_CLONES void find_turns(const NormalFeatures* blocks, Turns* turns, std::size_t count) {
  using Network = NormalNetwork;
  constexpr std::size_t kVectors = NormalFeatures::kVectors, kMixtures = Network::kMixtures;
  for (std::size_t b = 0; b < count; ++b) {
    LaneArray<kVectors> block_x, block_y;
    for (std::size_t k = 0; k < kVectors; ++k) {
      block_x[k] = blocks[b].x[k].load();
      block_y[k] = blocks[b].y[k].load();
    }
    LaneArray<kMixtures> x, y;
    apply(kNormalNetwork.mixing, {}, block_x, x);
    apply(kNormalNetwork.mixing, {}, block_y, y);
    LaneArray<Network::kInputs> in;
    for (std::size_t k = 0; k < kMixtures; ++k) in[k] = log_length(x[k], y[k]);
    for (std::size_t k = 0; k < kVectors; ++k) in[kMixtures + k] = log_length(block_x[k], block_y[k]);
    for (std::size_t k = 0; k < NormalFeatures::kScalars; ++k) {
      in[kMixtures + kVectors + k] = blocks[b].scalars[k].load();
    }
    LaneArray<Network::kHidden> first, second;
    apply(kNormalNetwork.first, kNormalNetwork.first_bias, in, first);
    rectify(first);
    apply(kNormalNetwork.second, kNormalNetwork.second_bias, first, second);
    rectify(second);
    LaneArray<Network::kFactors> factors;
    apply(kNormalNetwork.third, kNormalNetwork.third_bias, second, factors);
    Turns sum{};
    for (std::size_t k = 0; k < kMixtures; ++k) {
      sum.x += factors[k] * x[k];
      sum.y += factors[k] * y[k];
    }
    for (std::size_t k = 0; k < kVectors; ++k) {
      sum.x += factors[kMixtures + k] * block_x[k];
      sum.y += factors[kMixtures + k] * block_y[k];
    }
    turns[b] = sum;
  }
}

}  // namespace

FlatVectors regressed_normals(const FlatMesh& mesh, std::span<const float> positions, const DescentSight& sight,
                              float amount, ThreadTeam& team) {
  const std::size_t faces = mesh.face_count;
  const std::vector<NormalFeatures> features = normal_features(mesh, positions, sight, team);
  std::vector<Turns> turns(features.size());
  FlatVectors normals(3 * faces);
  constexpr std::size_t kBlocksATime = 64;
  team.run(features.size(), kBlocksATime, [&](std::size_t begin, std::size_t end, std::size_t) {
    find_turns(features.data() + begin, turns.data() + begin, end - begin);
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
      for (std::size_t axis = 0; axis < 3; ++axis) normals[axis * faces + f] = has_normal ? n[axis] * inverse : 0;
    }
  });
  return normals;
}

}  // namespace crease
