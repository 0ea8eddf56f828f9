#include "core/choice/features.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/base/quantile.h"

namespace crease {
namespace {

double log_of(double x) {
  constexpr double kLeast = 1e-3;
  return std::log(std::max(kLeast, x));
}

class Description {
 public:
  Description(const FlatMesh& mesh, const Evidence& evidence, const Candidate& candidate)
      : mesh_(mesh), evidence_(evidence), candidate_(candidate), residuals_(candidate.residuals) {
    const FlatVectors& positions = candidate.result.positions;
    for (const float angle : dihedral_angles(mesh, positions)) {
      const float chord = 2 * std::sin(angle / 2);
      bends_.push_back(chord * chord);
    }
    for (std::size_t e = 0; e < mesh.edge_count; ++e) {
      const auto from = vector_at(positions, end_of(e, 0)), to = vector_at(positions, end_of(e, 1));
      const Vec3 edge(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
      lengths_.push_back(edge.norm());
      directions_.push_back(direction(edge));
    }
  }

  Features features() {
    constexpr std::array kRidgeBends{0.06F, 0.15F, 0.35F};  // of 14°, 22° and 34°
    describe_noise();
    describe_bends();
    describe_edges();
    for (const float bend : kRidgeBends) describe_ridges(bend);
    describe_surroundings();
    describe_patches();
    describe_residuals();
    return features_;
  }

 private:
  std::size_t end_of(std::size_t e, std::size_t side) const {
    return static_cast<std::size_t>(mesh_.edge_ends[side][e]);
  }

  void describe_noise() {
    const FirstSight& sight = evidence_.sight;
    const double sigma = std::sqrt(evidence_.variance);
    add(std::log(sigma));
    add(log_of(sight.sigma / sigma));
    add(evidence_.impulsive ? 1 : 0);
    add(sight.direction == NoiseDirection::kIsotropic ? 1 : 0);
    add(sight.direction == NoiseDirection::kUnsure ? 1 : 0);
    add(sight.regular ? 1 : 0);
    add(log_of(sight.folded_share));
    add(log_of(sight.sigma_tangential / sigma));
    add(std::log(static_cast<double>(mesh_.vertex_count)));
    add(evidence_.varying ? 1 : 0);
    add(log_of(evidence_.noise_spread));
  }

  /// ‖n_i − n_j‖² over the edges.
  void describe_bends() {
    constexpr float kFromStair = 0.02F, kToStair = 0.12F;
    double sum = 0, stairs = 0;
    for (const float bend : bends_) {
      sum += static_cast<double>(bend);
      stairs += bend > kFromStair && bend < kToStair ? 1 : 0;
    }
    const double count = std::max(1.0, static_cast<double>(bends_.size()));
    add(log_of(sum / count));
    add(log_of(stairs / count));
    for (const double bend : quantiles(bends_, std::array{0.25, 0.5, 0.75, 0.9, 0.97})) add(log_of(std::sqrt(bend)));
  }

  /// How much their lengths differ.
  void describe_edges() {
    double sum = 0, squares = 0;
    for (const double length : lengths_) {
      sum += length;
      squares += length * length;
    }
    const double count = std::max(1.0, static_cast<double>(lengths_.size())), mean = sum / count;
    add(mean > 0 ? std::sqrt(std::max(0.0, squares / count - mean * mean)) / mean : 0);
  }

  /// Edges that bend more are ridges: how long they are, and whether they go on, go straight on, and do not branch.
  void describe_ridges(float least_bend) {
    constexpr double kGoesOn = 0.5, kGoesStraightOn = 0.87;  // cosines of the turn
    constexpr double kFewestEnds = 20, kFewestVertices = 10;
    double length = 0, ridge_length = 0, ends = 0, going_on = 0, going_straight_on = 0, vertices = 0, unbranched = 0;
    for (std::size_t e = 0; e < lengths_.size(); ++e) {
      length += lengths_[e];
      if (bends_[e] > least_bend) ridge_length += lengths_[e];
    }
    std::vector<Vec3> ways;
    for (std::size_t v = 0; v < mesh_.vertex_count; ++v) {
      find_ridges_from(v, least_bend, ways);
      if (ways.empty()) continue;
      ++vertices;
      unbranched += ways.size() == 2 ? 1 : 0;
      ends += static_cast<double>(ways.size());
      for (std::size_t i = 0; i < ways.size(); ++i) {
        double straightest = -1;
        for (std::size_t j = 0; j < ways.size(); ++j) {
          if (j != i) straightest = std::max(straightest, -ways[i].dot(ways[j]));
        }
        going_on += straightest > kGoesOn ? 1 : 0;
        going_straight_on += straightest > kGoesStraightOn ? 1 : 0;
      }
    }
    add(log_of(length > 0 ? ridge_length / length : 0));
    add(ends > kFewestEnds ? going_on / ends : 0.5);
    add(ends > kFewestEnds ? going_straight_on / ends : 0.3);
    add(vertices > kFewestVertices ? unbranched / vertices : 0.4);
  }

  /// The directions in which ridges leave a vertex.
  void find_ridges_from(std::size_t v, float least_bend, std::vector<Vec3>& ways) const {
    ways.clear();
    for (const Index e : mesh_.vertex_stencils[v]) {
      if (bends_[e] <= least_bend || (end_of(e, 0) != v && end_of(e, 1) != v)) continue;
      ways.push_back(end_of(e, 0) == v ? directions_[e] : -directions_[e]);
    }
  }

  /// How much the surroundings of each vertex bend, ridges left out, and whether the residuals are larger where they
  /// do: those of noise are not.
  void describe_surroundings() {
    constexpr float kRidgeBend = 0.1F, kLeast = 1e-5F;
    std::vector<float> around(mesh_.vertex_count);
    for (std::size_t v = 0; v < around.size(); ++v) {
      float sum = 0;
      for (const Index e : mesh_.vertex_stencils[v]) sum += bends_[e] / (1 + bends_[e] / kRidgeBend);
      around[v] = sum / static_cast<float>(std::max<std::size_t>(1, mesh_.vertex_stencils[v].size()));
    }
    mesh_.diffuse(around, 2);
    const auto [low, half, high, most] = quantiles(around, std::array{1.0 / 3, 0.5, 2.0 / 3, 0.9});
    add(log_of(half));
    add(log_of(most));
    double evenness = 0;
    for (std::size_t e = 0; e < bends_.size(); ++e) {
      const float mean = (around[end_of(e, 0)] + around[end_of(e, 1)]) / 2;
      evenness += static_cast<double>(std::log((bends_[e] + kLeast) / (mean + kLeast)));
    }
    add(evenness / std::max(1.0, static_cast<double>(bends_.size())));
    std::array<double, 3> squares{}, counts{1, 1, 1};
    for (std::size_t v = 0; v < around.size(); ++v) {
      const std::size_t third = around[v] <= low ? 0 : around[v] < high ? 1 : 2;
      squares[third] += static_cast<double>(residuals_[v] * residuals_[v]);
      ++counts[third];
    }
    for (const std::size_t third : {1U, 2U}) add(log_of(squares[third] / counts[third] / evidence_.variance));
  }

  /// How far normals turn within two rings, where they turn most.
  void describe_patches() {
    const FlatVectors& normals = candidate_.result.vertex_normals;
    const std::size_t count = mesh_.vertex_count;
    std::vector<float> turn(count, 1);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto begin = normals.begin() + static_cast<std::ptrdiff_t>(axis * count);
      std::vector<float> mean(begin, begin + static_cast<std::ptrdiff_t>(count));
      mesh_.diffuse(mean, 2);
      for (std::size_t v = 0; v < count; ++v) turn[v] -= mean[v] * mean[v];
    }
    add(log_of(quantile(std::move(turn), 0.9)));
  }

  /// How heavy their tails are. Noise is as strong between neighbours as over wide patches; shape is not.
  void describe_residuals() {
    const double count = static_cast<double>(mesh_.vertex_count);
    double mean_square = 0, mean_fourth = 0;
    for (const float residual : residuals_) {
      const double square = static_cast<double>(residual * residual) / evidence_.variance;
      mean_square += square / count;
      mean_fourth += square * square / count;
    }
    add(log_of(mean_square));
    add(log_of(mean_fourth / (mean_square * mean_square + 1e-12)));
    double twists = 0;
    for (std::size_t e = 0; e < mesh_.edge_count; ++e) {
      const float twist = residuals_[end_of(e, 0)] + residuals_[end_of(e, 1)] -
                          residuals_[static_cast<std::size_t>(mesh_.edge_opposites[0][e])] -
                          residuals_[static_cast<std::size_t>(mesh_.edge_opposites[1][e])];
      twists += static_cast<double>(twist * twist);
    }
    add(log_of(twists / std::max(1.0, static_cast<double>(mesh_.edge_count)) / evidence_.variance));
    std::vector<float> means(residuals_);
    for (const int rounds : {1, 2, 5}) {
      mesh_.diffuse(means, rounds);
      double squares = 0;
      for (const float mean : means) squares += static_cast<double>(mean * mean);
      add(log_of(squares / count / evidence_.variance));
    }
  }

  void add(double feature) { features_.at(known_++) = feature; }

  const FlatMesh& mesh_;
  const Evidence& evidence_;
  const Candidate& candidate_;
  const std::vector<float>& residuals_;
  std::vector<float> bends_;
  std::vector<double> lengths_;   ///< of edges
  std::vector<Vec3> directions_;  ///< from their first to their second end
  Features features_{};
  std::size_t known_ = 0;
};

}  // namespace

Features features_of(const FlatMesh& mesh, const Evidence& evidence, const Candidate& candidate) {
  return Description(mesh, evidence, candidate).features();
}

}  // namespace crease
