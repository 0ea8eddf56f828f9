#include "core/graduated/lbfgs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/geometry/lanes.h"

namespace crease {
namespace {

constexpr std::size_t kHistory = 5;
constexpr std::size_t kVectorBlock = 4096;
constexpr double kSufficientDecrease = 1e-4;
constexpr int kTrials = 12;
constexpr int kPatience = 3;

CREASE_WIDE_CLONES double dot_block(const float* a, const float* b, std::size_t count) {
  std::array<float, 16> lanes{};
  std::size_t i = 0;
  for (; i + 16 <= count; i += 16) {
    for (std::size_t k = 0; k < 16; ++k) lanes[k] += a[i + k] * b[i + k];
  }
  double sum = 0;
  for (const float lane : lanes) sum += static_cast<double>(lane);
  for (; i < count; ++i) sum += static_cast<double>(a[i] * b[i]);
  return sum;
}

/// a += factor · b
CREASE_WIDE_CLONES void add_block(float* __restrict a, float factor, const float* __restrict b, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) a[i] += factor * b[i];
}

struct Pair {
  std::vector<float> step, change;  ///< of x and of the gradient
  double inverse = 0;               ///< 1/(step·change)
};

class Search {
 public:
  Search(const DifferentiableFunction& function, std::vector<float>& x, const LbfgsOptions& options, ThreadTeam& team)
      : function_(function),
        x_(x),
        options_(options),
        team_(team),
        g_(x.size()),
        d_(x.size()),
        trial_(x.size()),
        trial_g_(x.size()) {
    for (Pair& pair : history_) {
      pair.step.resize(x.size());
      pair.change.resize(x.size());
    }
  }

  double run() {
    value_ = function_(x_, g_);
    if (options_.on_start) options_.on_start();
    int small_gains = 0;
    for (int step = 0; step < options_.steps && small_gains < kPatience; ++step) {
      set_direction();
      const double slope = dot(d_, g_);
      const double before = value_;
      if (!(slope < 0) || !move(slope)) {
        if (size_ == 0) break;
        size_ = 0;  // what was learnt of the curvature misleads
        continue;
      }
      small_gains = before - value_ < options_.least_gain * std::abs(value_) ? small_gains + 1 : 0;
    }
    return value_;
  }

 private:
  double dot(const std::vector<float>& a, const std::vector<float>& b) {
    const std::size_t count = a.size();
    std::vector<double> sums((count + kVectorBlock - 1) / kVectorBlock);
    team_.run(sums.size(), 4, [&](std::size_t first, std::size_t last, std::size_t) {
      for (std::size_t block = first; block < last; ++block) {
        const std::size_t begin = block * kVectorBlock;
        sums[block] = dot_block(a.data() + begin, b.data() + begin, std::min(kVectorBlock, count - begin));
      }
    });
    double total = 0;
    for (const double sum : sums) total += sum;
    return total;
  }

  void add(std::vector<float>& a, double factor, const std::vector<float>& b) {
    team_.run(a.size(), 4 * kVectorBlock, [&](std::size_t begin, std::size_t end, std::size_t) {
      add_block(a.data() + begin, static_cast<float>(factor), b.data() + begin, end - begin);
    });
  }

  Pair& recent(std::size_t age) { return history_[(next_ + kHistory - 1 - age) % kHistory]; }

  /// The two-loop recursion.
  void set_direction() {
    for (std::size_t i = 0; i < d_.size(); ++i) d_[i] = -g_[i];
    std::array<double, kHistory> alpha{};
    for (std::size_t age = 0; age < size_; ++age) {
      const Pair& pair = recent(age);
      alpha[age] = pair.inverse * dot(pair.step, d_);
      add(d_, -alpha[age], pair.change);
    }
    if (options_.precondition) options_.precondition(d_);
    if (options_.scale_metric && size_ > 0) {
      const Pair& last = recent(0);
      const auto scale = static_cast<float>(1 / (last.inverse * squared_length(last.change)));
      for (float& number : d_) number *= scale;
    }
    for (std::size_t age = size_; age-- > 0;) {
      const Pair& pair = recent(age);
      add(d_, alpha[age] - pair.inverse * dot(pair.change, d_), pair.step);
    }
  }

  /// In the first metric.
  double squared_length(const std::vector<float>& gradient) {
    if (!options_.precondition) return dot(gradient, gradient);
    worth_ = gradient;
    options_.precondition(worth_);
    return dot(gradient, worth_);
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
    if (size_ == 0 && options_.scale_metric) return static_cast<double>(options_.first_move) / longest_move();
    if (options_.longest_move > 0) return std::min(1.0, static_cast<double>(options_.longest_move) / longest_move());
    return 1;
  }

  /// Along the direction to a point that is low enough. False where there is none.
  bool move(double slope) {
    double length = first_length();
    for (int trial = 0; trial < kTrials; ++trial) {
      trial_ = x_;
      add(trial_, length, d_);
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

  void accept(double value) {
    Pair& pair = history_[next_];
    for (std::size_t i = 0; i < x_.size(); ++i) {
      pair.step[i] = trial_[i] - x_[i];
      pair.change[i] = trial_g_[i] - g_[i];
    }
    const double curvature = dot(pair.step, pair.change);
    if (curvature > 1e-10 * dot(pair.change, pair.change)) {
      pair.inverse = 1 / curvature;
      next_ = (next_ + 1) % kHistory;
      size_ = std::min(size_ + 1, kHistory);
    }
    x_.swap(trial_);
    g_.swap(trial_g_);
    value_ = value;
  }

  const DifferentiableFunction& function_;
  std::vector<float>& x_;
  const LbfgsOptions& options_;
  ThreadTeam& team_;
  std::vector<float> g_, d_, trial_, trial_g_, worth_;
  std::array<Pair, kHistory> history_;
  std::size_t size_ = 0, next_ = 0;
  double value_ = 0;
};

}  // namespace

double minimize(const DifferentiableFunction& function, std::vector<float>& x, const LbfgsOptions& options,
                ThreadTeam& team) {
  return Search(function, x, options, team).run();
}

}  // namespace crease
