#include "core/graduated/lbfgs.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/geometry/lanes.h"

namespace crease {
namespace {

constexpr std::size_t kHistory = 5;
constexpr std::size_t kSlots = kHistory + 1;  ///< one for the pair of the present step
constexpr std::size_t kVectorBlock = 1024;    ///< so many numbers of the whole history fit into the nearest cache
constexpr double kSufficientDecrease = 1e-4;
constexpr int kTrials = 12;
constexpr int kPatience = 3;

/// Blocks of some vectors, and a number for each.
using Blocks = std::array<const float*, kHistory>;
using Factors = std::array<float, kHistory>;

/// Σ a_i b_i of each of some blocks b. Sixteen sums run side by side, whatever the machine's lanes are.
template <std::size_t blocks>
CREASE_LANES_INLINE std::array<double, blocks> products_of(const float* a, const std::array<const float*, blocks>& b,
                                                           std::size_t count) {
  LaneArray<blocks> even{}, odd{};
  std::size_t i = 0;
  for (; i + 16 <= count; i += 16) {
    const Lanes first = eight(a + i), second = eight(a + i + 8);
    for (std::size_t k = 0; k < blocks; ++k) {
      even[k] += first * eight(b[k] + i);
      odd[k] += second * eight(b[k] + i + 8);
    }
  }
  std::array<double, blocks> sums{};
  for (std::size_t k = 0; k < blocks; ++k) {
    sums[k] = static_cast<double>(sum(even[k] + odd[k]));
    for (std::size_t rest = i; rest < count; ++rest) sums[k] += static_cast<double>(a[rest] * b[k][rest]);
  }
  return sums;
}

CREASE_WIDE_CLONES double dot_block(const float* a, const float* b, std::size_t count) {
  return products_of<1>(a, {b}, count)[0];
}

CREASE_WIDE_CLONES std::array<double, kHistory> dot_blocks(const float* a, const Blocks& b, std::size_t count) {
  return products_of<kHistory>(a, b, count);
}

/// step · gradient and step · change
CREASE_WIDE_CLONES std::array<double, 2> dot_step(const float* step, const float* gradient, const float* change,
                                                  std::size_t count) {
  return products_of<2>(step, {gradient, change}, count);
}

/// Σ a_i² b_i
CREASE_WIDE_CLONES double weighted_square_block(const float* a, const float* b, std::size_t count) {
  std::array<float, 16> lanes{};
  std::size_t i = 0;
  for (; i + 16 <= count; i += 16) {
    for (std::size_t k = 0; k < 16; ++k) lanes[k] += a[i + k] * a[i + k] * b[i + k];
  }
  double sum = 0;
  for (const float lane : lanes) sum += static_cast<double>(lane);
  for (; i < count; ++i) sum += static_cast<double>(a[i] * a[i] * b[i]);
  return sum;
}

/// result = scale · (base + Σ_k factor_k · block_k)
CREASE_WIDE_CLONES void combine_blocks(float* result, const float* base, float scale, const Factors& factors,
                                       const Blocks& blocks, std::size_t count) {
  CREASE_INDEPENDENT_PASSES
  for (std::size_t i = 0; i < count; ++i) {
    float sum = base[i];
    for (std::size_t k = 0; k < kHistory; ++k) sum += factors[k] * blocks[k][i];
    result[i] = scale * sum;
  }
}

/// result = a + factor · b
CREASE_WIDE_CLONES void sum_block(float* __restrict result, const float* __restrict a, float factor,
                                  const float* __restrict b, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) result[i] = a[i] + factor * b[i];
}

/// a *= b
CREASE_WIDE_CLONES void multiply_block(float* __restrict a, const float* __restrict b, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) a[i] *= b[i];
}

/// A search reads its history thrice a step, and little else costs time where a mesh is too large for the caches. So
/// what a step needs of products is computed block by block while the block is at hand, and the two-loop recursion runs
/// over the products alone.
class Search {
 public:
  Search(const DifferentiableFunction& function, std::vector<float>& x, const LbfgsOptions& options, ThreadTeam& team,
         LbfgsMemory& memory)
      : function_(function),
        x_(x),
        options_(options),
        team_(team),
        last_(memory.last),
        g_(memory.vectors[0]),
        d_(memory.vectors[1]),
        trial_(memory.vectors[2]),
        trial_g_(memory.vectors[3]) {
    for (std::size_t k = 0; k < kSlots; ++k) {
      pairs_[k].step = &memory.vectors[kOwnVectors + 2 * k];
      pairs_[k].change = &memory.vectors[kOwnVectors + 2 * k + 1];
    }
  }

  /// Makes `memory` large enough for a search in `count` numbers.
  static LbfgsMemory& prepared(LbfgsMemory& memory, std::size_t count) {
    memory.vectors.resize(kOwnVectors + 2 * kSlots);
    for (std::vector<float>& vector : memory.vectors) vector.resize(count);
    return memory;
  }

  double run() {
    value_ = function_(x_, g_);
    if (options_.on_start) options_.on_start();
    if (options_.goes_on && last_.step.size() == x_.size()) take_last_step();
    int small_gains = 0;
    for (int step = 0; step < options_.steps && small_gains < kPatience; ++step) {
      const double slope = set_direction();
      const double before = value_;
      if (!(slope < 0) || !move(slope)) {
        if (size_ == 0) break;
        size_ = 0;  // what was learnt of the curvature misleads
        continue;
      }
      small_gains = before - value_ < options_.least_gain * std::abs(value_) ? small_gains + 1 : 0;
    }
    if (options_.goes_on) leave_last_step();
    return value_;
  }

 private:
  using Products = Eigen::Array<double, kSlots, 1>;  ///< a number for each slot
  static constexpr std::size_t kOwnVectors = 4;      ///< beside the pairs

  /// A step, and the change of the gradient over it.
  struct Pair {
    std::vector<float>*step = nullptr, *change = nullptr;
    Products step_times_changes = Products::Zero();  ///< its own change, and those of newer pairs
    double step_times_gradient = 0;                  ///< the present gradient
    double metric_scale = 1;                         ///< of a diagonal metric, as this step tells it
  };

  /// What a new pair has to do with the others.
  struct NewProducts {
    Products steps_times_gradient = Products::Zero();
    Products steps_times_change = Products::Zero();
    double squared_change = 0, squared_in_metric = 0;

    NewProducts& operator+=(const NewProducts& other) {
      steps_times_gradient += other.steps_times_gradient;
      steps_times_change += other.steps_times_change;
      squared_change += other.squared_change;
      squared_in_metric += other.squared_in_metric;
      return *this;
    }
  };

  /// The sum over all blocks of what `body(begin, count)` returns for one.
  template <typename Body>
  auto sum_over_blocks(Body body) {
    const std::size_t count = x_.size();
    using Value = decltype(body(count, count));
    std::vector<Value> sums((count + kVectorBlock - 1) / kVectorBlock);
    team_.run(sums.size(), 1, [&](std::size_t first, std::size_t last, std::size_t) {
      for (std::size_t block = first; block < last; ++block) {
        sums[block] = body(block * kVectorBlock, std::min(kVectorBlock, count - block * kVectorBlock));
      }
    });
    Value total = sums.front();
    for (std::size_t block = 1; block < sums.size(); ++block) total += sums[block];
    return total;
  }

  std::size_t slot(std::size_t age) const { return (next_ + kSlots - 1 - age) % kSlots; }
  Pair& recent(std::size_t age) { return pairs_[slot(age)]; }
  template <typename Numbers>
  auto& at(Numbers& numbers, std::size_t age) const {
    return numbers[static_cast<Eigen::Index>(slot(age))];
  }

  /// Sets d to minus the gradient times the inverse Hessian, as far as it is known: the two-loop recursion. Returns the
  /// slope along it.
  double set_direction() {
    Products alpha = Products::Zero();
    for (std::size_t age = 0; age < size_; ++age) {
      const Pair& pair = recent(age);
      const double known = (alpha * pair.step_times_changes).sum();
      at(alpha, age) = (pair.step_times_gradient - known) / at(pair.step_times_changes, age);
    }
    const Products products = begin_direction(alpha);
    Products factors = Products::Zero();
    for (std::size_t age = size_; age-- > 0;) {
      double product = at(products, age);
      for (std::size_t older = age + 1; older < size_; ++older) {
        product += at(factors, older) * at(recent(older).step_times_changes, age);
      }
      at(factors, age) = at(alpha, age) - product / at(recent(age).step_times_changes, age);
    }
    return end_direction(factors);
  }

  /// Blocks of the steps, or of the changes, the most recent first. Where there is no pair yet the gradient stands in;
  /// its factor is zero.
  Blocks blocks_of(std::vector<float>* Pair::*vectors, std::size_t begin) {
    Blocks blocks{};
    for (std::size_t age = 0; age < kHistory; ++age) {
      blocks[age] = (age < size_ ? recent(age).*vectors : &g_)->data() + begin;
    }
    return blocks;
  }

  /// The numbers of the slots by age.
  Factors factors_by_age(const Products& numbers) const {
    Factors factors{};
    for (std::size_t age = 0; age < size_; ++age) factors[age] = static_cast<float>(at(numbers, age));
    return factors;
  }

  /// d = M (g − Σ α change). Returns its products with the changes.
  Products begin_direction(const Products& alpha) {
    const Factors factors = factors_by_age(-alpha);
    const auto scale = static_cast<float>(size_ > 0 && !options_.solve ? recent(0).metric_scale : 1);
    Products products = sum_over_blocks([&](std::size_t begin, std::size_t count) {
      float* const d = d_.data() + begin;
      combine_blocks(d, g_.data() + begin, scale, factors, blocks_of(&Pair::change, begin), count);
      if (options_.solve) return Products(Products::Zero());
      if (options_.diagonal != nullptr) multiply_block(d, options_.diagonal->data() + begin, count);
      return products_with_changes(begin, count);
    });
    if (!options_.solve) return products;
    options_.solve(d_);
    return sum_over_blocks([&](std::size_t begin, std::size_t count) { return products_with_changes(begin, count); });
  }

  Products products_with_changes(std::size_t begin, std::size_t count) {
    const auto by_age = dot_blocks(d_.data() + begin, blocks_of(&Pair::change, begin), count);
    Products products = Products::Zero();
    for (std::size_t age = 0; age < size_; ++age) at(products, age) = by_age[age];
    return products;
  }

  /// d = −(d + Σ factor · step). Returns its product with the gradient.
  double end_direction(const Products& numbers) {
    const Factors factors = factors_by_age(numbers);
    return sum_over_blocks([&](std::size_t begin, std::size_t count) {
      float* const d = d_.data() + begin;
      combine_blocks(d, d, -1, factors, blocks_of(&Pair::step, begin), count);
      return dot_block(d, g_.data() + begin, count);
    });
  }

  double longest_move() const {
    const std::size_t count = d_.size() / 3;
    float longest = 0;
    for (std::size_t v = 0; v < count; ++v) {
      const float x = d_[v], y = d_[count + v], z = d_[2 * count + v];
      longest = std::max(longest, x * x + y * y + z * z);
    }
    return std::sqrt(static_cast<double>(longest));
  }

  double first_length() const {
    if (size_ == 0 && !options_.solve) return static_cast<double>(options_.first_move) / longest_move();
    if (options_.longest_move > 0) return std::min(1.0, static_cast<double>(options_.longest_move) / longest_move());
    return 1;
  }

  /// Along the direction to a point that is low enough. False where there is none.
  bool move(double slope) {
    double length = first_length();
    for (int trial = 0; trial < kTrials; ++trial) {
      team_.run(x_.size(), kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
        sum_block(trial_.data() + begin, x_.data() + begin, static_cast<float>(length), d_.data() + begin, end - begin);
      });
      const double value = function_(trial_, trial_g_);
      if (value <= value_ + kSufficientDecrease * length * slope) {
        accept(value);
        return true;
      }
      const double excess = value - value_ - slope * length;
      const double lowest = excess > 0 ? -slope * length * length / (2 * excess) : length / 2;
      length = std::clamp(lowest, length / 10, length / 2);
    }
    return false;
  }

  /// The trial becomes the present point, and the step to it the most recent pair, unless it tells nothing.
  void accept(double value) {
    const NewProducts products =
        sum_over_blocks([&](std::size_t begin, std::size_t count) { return write_pair(begin, count); });
    for (std::size_t k = 0; k < kSlots; ++k) {
      const auto place = static_cast<Eigen::Index>(k);
      pairs_[k].step_times_gradient = products.steps_times_gradient[place];
      pairs_[k].step_times_changes[static_cast<Eigen::Index>(next_)] = products.steps_times_change[place];
    }
    Pair& pair = pairs_[next_];
    const double curvature = pair.step_times_changes[static_cast<Eigen::Index>(next_)];
    if (curvature > 1e-10 * products.squared_change) {
      pair.metric_scale = curvature / products.squared_in_metric;
      next_ = (next_ + 1) % kSlots;
      size_ = std::min(size_ + 1, kHistory);
    }
    x_.swap(trial_);
    g_.swap(trial_g_);
    value_ = value;
  }

  /// Writes a block of the new pair.
  NewProducts write_pair(std::size_t begin, std::size_t count) {
    float* const step = pairs_[next_].step->data() + begin;
    float* const change = pairs_[next_].change->data() + begin;
    const float* const gradient = trial_g_.data() + begin;
    sum_block(step, trial_.data() + begin, -1, x_.data() + begin, count);
    sum_block(change, gradient, -1, g_.data() + begin, count);
    NewProducts products;
    for (std::size_t k = 0; k < kSlots; ++k) {
      if (k != next_ && !is_known(k)) continue;
      const auto place = static_cast<Eigen::Index>(k);
      const auto [with_gradient, with_change] = dot_step(pairs_[k].step->data() + begin, gradient, change, count);
      products.steps_times_gradient[place] = with_gradient;
      products.steps_times_change[place] = with_change;
    }
    products.squared_change = dot_block(change, change, count);
    products.squared_in_metric = squared_in_metric(change, begin, count);
    return products;
  }

  double squared_in_metric(const float* change, std::size_t begin, std::size_t count) const {
    return options_.diagonal == nullptr ? dot_block(change, change, count)
                                        : weighted_square_block(change, options_.diagonal->data() + begin, count);
  }

  /// The only pair is the last one of the search before, as the present gradient and metric see it.
  void take_last_step() {
    Pair& pair = pairs_[0];
    pair.step->swap(last_.step);
    pair.change->swap(last_.change);
    const Eigen::Array3d products = sum_over_blocks([&](std::size_t begin, std::size_t count) {
      const float *const step = pair.step->data() + begin, *const change = pair.change->data() + begin;
      return Eigen::Array3d(dot_block(step, g_.data() + begin, count), dot_block(step, change, count),
                            squared_in_metric(change, begin, count));
    });
    pair.step_times_gradient = products[0];
    pair.step_times_changes[0] = products[1];
    pair.metric_scale = products[1] / products[2];
    size_ = next_ = 1;
  }

  void leave_last_step() {
    if (size_ == 0) {
      last_ = {};
      return;
    }
    last_.step.swap(*recent(0).step);
    last_.change.swap(*recent(0).change);
  }

  /// Whether a slot holds one of the recent pairs.
  bool is_known(std::size_t k) const { return (next_ + kSlots - 1 - k) % kSlots < size_; }

  const DifferentiableFunction& function_;
  std::vector<float>& x_;
  const LbfgsOptions& options_;
  ThreadTeam& team_;
  LbfgsStep& last_;
  std::vector<float>&g_, &d_, &trial_, &trial_g_;
  std::array<Pair, kSlots> pairs_;
  std::size_t size_ = 0, next_ = 0;
  double value_ = 0;
};

}  // namespace

double minimize(const DifferentiableFunction& function, std::vector<float>& x, const LbfgsOptions& options,
                ThreadTeam& team, LbfgsMemory& memory) {
  return Search(function, x, options, team, Search::prepared(memory, x.size())).run();
}

}  // namespace crease
