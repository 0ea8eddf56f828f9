#include "core/features/graph_cut.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <random>

namespace crease {
namespace {

constexpr int kSites = 8;

/// Small integers, so that sums are exact and ties are common.
class Dice {
 public:
  explicit Dice(unsigned seed) : random_(seed) {}
  double operator()(int most) { return std::uniform_int_distribution<int>(0, most)(random_); }

 private:
  std::mt19937 random_;
};

struct Arc {
  Index tail, head;
  double forward, backward;
};

struct RandomNetwork {
  explicit RandomNetwork(Dice& dice) {
    for (auto& [source, sink] : terminals) {
      source = dice(9);
      sink = dice(9);
    }
    for (Index a = 0; a < kSites; ++a) {
      for (Index b = a + 1; b < kSites; ++b) {
        if (dice(2) == 0) arcs.push_back({a, b, dice(7), dice(7)});
      }
    }
  }

  double cut(unsigned sink_side) const {
    double sum = 0;
    for (unsigned v = 0; v < kSites; ++v) sum += (sink_side >> v & 1U) != 0 ? terminals[v].first : terminals[v].second;
    for (const Arc& arc : arcs) {
      const bool tail = (sink_side >> arc.tail & 1U) != 0, head = (sink_side >> arc.head & 1U) != 0;
      sum += !tail && head ? arc.forward : tail && !head ? arc.backward : 0;
    }
    return sum;
  }

  std::array<std::pair<double, double>, kSites> terminals;
  std::vector<Arc> arcs;
};

TEST(FlowNetwork, FlowIsTheSmallestCutAndItsSinkSideTheSmallest) {
  Dice dice(1);
  for (int trial = 0; trial < 400; ++trial) {
    const RandomNetwork random(dice);
    FlowNetwork network;
    for (const auto& [source, sink] : random.terminals) network.add_terminal(network.add_node(), source, sink);
    for (const Arc& arc : random.arcs) network.add_arc(arc.tail, arc.head, arc.forward, arc.backward);

    double smallest = std::numeric_limits<double>::max();
    int fewest = 0;
    for (unsigned side = 0; side < 1U << kSites; ++side) {
      const double cut = random.cut(side);
      if (cut < smallest || (cut == smallest && std::popcount(side) < fewest)) fewest = std::popcount(side);
      smallest = std::min(smallest, cut);
    }
    EXPECT_EQ(network.solve(), smallest);
    unsigned found = 0;
    for (Index v = 0; v < kSites; ++v) found |= network.on_sink_side(v) ? 1U << v : 0;
    EXPECT_EQ(random.cut(found), smallest);
    EXPECT_EQ(std::popcount(found), fewest);
  }
}

TEST(FlowNetwork, LongPathsAndManyPhases) {
  const Index length = 20000;
  FlowNetwork network;
  for (Index v = 0; v < length; ++v) network.add_node();
  network.add_terminal(0, 5, 0);
  network.add_terminal(length - 1, 0, 4);
  for (Index v = 0; v + 1 < length; ++v) network.add_arc(v, v + 1, v == length / 2 ? 3 : 6, 0);
  EXPECT_EQ(network.solve(), 3);
  EXPECT_FALSE(network.on_sink_side(length / 2));
  EXPECT_TRUE(network.on_sink_side(length / 2 + 1));
}

TEST(FlowNetwork, NothingFlowsWithoutNodes) { EXPECT_EQ(FlowNetwork().solve(), 0); }

TEST(BinaryEnergy, MinimisesSubmodularEnergies) {
  Dice dice(2);
  for (int trial = 0; trial < 300; ++trial) {
    struct Pair {
      Index a, b;
      std::array<std::array<double, 2>, 2> cost;
    };
    std::array<std::array<double, 2>, kSites> unary;
    for (auto& cost : unary) cost = {dice(9) - 4, dice(9) - 4};
    std::vector<Pair> pairs;
    for (Index a = 0; a < kSites; ++a) {
      for (Index b = 0; b < a; ++b) {
        Pair pair{a, b, {{{dice(6) - 3, dice(6)}, {dice(6), 0}}}};
        pair.cost[1][1] = pair.cost[0][1] + pair.cost[1][0] - pair.cost[0][0] - dice(5);
        if (dice(1) == 0) pairs.push_back(pair);
      }
    }
    const auto energy = [&](auto label) {
      double sum = 0;
      for (Index v = 0; v < kSites; ++v) sum += unary[v][label(v)];
      for (const Pair& pair : pairs) sum += pair.cost[label(pair.a)][label(pair.b)];
      return sum;
    };
    BinaryEnergy cut;
    for (const auto& cost : unary) cut.add_unary(cut.add_site(), cost[0], cost[1]);
    for (const auto& [a, b, cost] : pairs) cut.add_pair(a, b, cost[0][0], cost[0][1], cost[1][0], cost[1][1]);

    double smallest = std::numeric_limits<double>::max();
    for (unsigned labels = 0; labels < 1U << kSites; ++labels) {
      smallest = std::min(smallest, energy([&](Index v) { return labels >> v & 1U; }));
    }
    EXPECT_EQ(cut.minimise(), smallest);
    EXPECT_EQ(energy([&](Index v) { return cut.label(v) ? 1U : 0U; }), smallest);
  }
}

}  // namespace
}  // namespace crease
