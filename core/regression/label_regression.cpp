#include "core/regression/label_regression.h"

#include "core/graduated/fast_math.h"
#include "core/regression/label_network.h"

namespace crease {
namespace {

/// Of the odds' logarithm. The network was fitted to results of settings that were named at random, too; of those that
/// the choice takes it is surer than it says.
constexpr float kSureness = 1.2F, kShift = 0.05F;
constexpr float kSurest = 30;  ///< logarithm of the odds; far within what fast_exp takes

CREASE_WIDE_CLONES void find_labels(const LabelFeatures::Block& in, float* labels) {
  const LabelNetwork& network = kLabelNetwork;
  LaneArray<LabelNetwork::kHidden> first, second;
  apply(network.first, network.first_bias, in, first);
  rectify(first);
  apply(network.second, network.second_bias, first, second);
  rectify(second);
  LaneArray<1> odds;
  apply(network.third, network.third_bias, second, odds);
  const Lanes surer = kSureness * odds[0] + kShift,
              below = surer > -kSurest ? surer : -kSurest + Lanes{},  // no number: the least
      sure = below < kSurest ? below : kSurest + Lanes{};
  store(1 / (1 + fast_exp(-sure)), labels);
}

}  // namespace

std::vector<float> regressed_labels(const FlatMesh& mesh, const LabelFeatures& features, ThreadTeam& team) {
  const std::size_t blocks = (mesh.edge_count + kLaneCount - 1) / kLaneCount;
  std::vector<float> labels(blocks * kLaneCount);
  team.run(blocks, kChunk / kLaneCount, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t b = begin; b < end; ++b) find_labels(features.block(b), labels.data() + b * kLaneCount);
  });
  labels.resize(mesh.edge_count);
  return labels;
}

}  // namespace crease
