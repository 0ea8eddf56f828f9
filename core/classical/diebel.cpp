#include "core/classical/diebel.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>

#include "core/classical/methods.h"

namespace crease {
namespace {

/// Where ‖n_i − n_j‖ turns from a cone into a paraboloid: half a degree.
constexpr double kRounding = 0.01;
/// Twice the area in ℓ² below which a normal fades to zero.
constexpr double kNoArea = 1e-3;
constexpr int kMostTrials = 12;

double rounded_norm(const Vec3& vector, double rounding) {
  return std::sqrt(vector.squaredNorm() + rounding * rounding);
}

double dot(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
  return sum;
}

/// Nonlinear conjugate gradients [Polak & Ribière 1969, restarted where β < 0] with a line search that fits a parabola.
class Diebel {
 public:
  Diebel(Surface& surface, double likelihood_weight)
      : surface_(surface), energy_(surface, likelihood_weight), trial_(surface.positions) {
    value_ = energy_.value(surface_.positions, gradient_);
    previous_ = gradient_;
    search_.assign(gradient_.size(), Vec3::Zero());
  }

  bool operator()() {
    turn_search();
    if (!descend()) {
      if (steepest_) return false;
      restart_ = true;
      return true;
    }
    previous_.swap(gradient_);
    value_ = energy_.value(surface_.positions, gradient_);
    return true;
  }

 private:
  void turn_search() {
    const double last = dot(previous_, previous_);
    double beta = last > 0 ? (dot(gradient_, gradient_) - dot(gradient_, previous_)) / last : 0;
    steepest_ = restart_ || !(beta > 0);
    if (steepest_) beta = 0;
    for (std::size_t i = 0; i < search_.size(); ++i) search_[i] = beta * search_[i] - gradient_[i];
    slope_ = dot(search_, gradient_);
    if (slope_ >= 0) {
      steepest_ = true;
      for (std::size_t i = 0; i < search_.size(); ++i) search_[i] = -gradient_[i];
      slope_ = -dot(gradient_, gradient_);
    }
    restart_ = false;
  }

  double try_step(double length) {
    for (const Index v : surface_.movable) trial_[v] = surface_.positions[v] + length * search_[v];
    return energy_.value(trial_);
  }

  /// Moves along the search direction to lower energy; false where there is none to be found.
  bool descend() {
    if (!(slope_ < 0)) return false;
    double length = last_decrease_ > 0 ? 2 * last_decrease_ / -slope_ : first_length();
    for (int trial = 0; trial < kMostTrials; ++trial) {
      const double found = try_step(length);
      const double excess = found - value_ - slope_ * length;
      const double best = excess > 0 ? -slope_ * length * length / (2 * excess) : 4 * length;
      if (found < value_) {
        accept(found, length, std::min(best, 4 * length));
        return true;
      }
      length = std::clamp(best, 0.1 * length, 0.5 * length);
    }
    return false;
  }

  /// Takes the better of a step that lowers the energy and one to where the parabola has its minimum.
  void accept(double found, double length, double best) {
    const double better = try_step(best);
    const bool is_better = better < found;
    if (!is_better) try_step(length);
    last_decrease_ = value_ - (is_better ? better : found);
    surface_.positions.swap(trial_);
  }

  /// Moves no vertex by more than a tenth of the mean edge length.
  double first_length() const {
    double most = 0;
    for (const Vec3& component : search_) most = std::max(most, component.norm());
    return 0.1 / most;
  }

  Surface& surface_;
  DiebelEnergy energy_;
  std::vector<Vec3> trial_, gradient_, previous_, search_;
  double value_ = 0, slope_ = 0, last_decrease_ = 0;
  bool steepest_ = true, restart_ = true;
};

}  // namespace

DiebelEnergy::DiebelEnergy(const Surface& surface, double likelihood_weight)
    : surface_(surface),
      likelihood_weight_(likelihood_weight),
      normals_(surface.faces.size()),
      normal_gradient_(surface.faces.size()),
      double_areas_(surface.faces.size()) {}

void DiebelEnergy::update_normals(const std::vector<Vec3>& positions) {
  for (std::size_t f = 0; f < normals_.size(); ++f) {
    const auto [a, b, c] = surface_.faces[f];
    const Vec3 area_vector = (positions[b] - positions[a]).cross(positions[c] - positions[a]);
    double_areas_[f] = rounded_norm(area_vector, kNoArea);
    normals_[f] = area_vector / double_areas_[f];
  }
}

double DiebelEnergy::likelihood(const std::vector<Vec3>& positions) const {
  double sum = 0;
  for (const Index v : surface_.movable) sum += (positions[v] - surface_.measured[v]).squaredNorm();
  return likelihood_weight_ * sum;
}

double DiebelEnergy::value(const std::vector<Vec3>& positions) {
  update_normals(positions);
  const Topology& topology = surface_.topology;
  double sum = 0;
  for (std::size_t e = 0; e < topology.edges.size(); ++e) {
    if (!topology.is_interior(e)) continue;
    const auto [f0, f1] = topology.edge_faces[e];
    sum += rounded_norm(normals_[f0] - normals_[f1], kRounding);
  }
  return sum + likelihood(positions);
}

double DiebelEnergy::value(const std::vector<Vec3>& positions, std::vector<Vec3>& gradient) {
  update_normals(positions);
  const Topology& topology = surface_.topology;
  normal_gradient_.assign(normal_gradient_.size(), Vec3::Zero());
  double sum = 0;
  for (std::size_t e = 0; e < topology.edges.size(); ++e) {
    if (!topology.is_interior(e)) continue;
    const auto [f0, f1] = topology.edge_faces[e];
    const Vec3 difference = normals_[f0] - normals_[f1];
    const double norm = rounded_norm(difference, kRounding);
    normal_gradient_[f0] += difference / norm;
    normal_gradient_[f1] -= difference / norm;
    sum += norm;
  }
  gradient.assign(positions.size(), Vec3::Zero());
  add_prior_gradient(positions, gradient);
  for (std::size_t v = 0; v < gradient.size(); ++v) {
    gradient[v] += 2 * likelihood_weight_ * (positions[v] - surface_.measured[v]);
    if (surface_.is_movable[v] == 0) gradient[v].setZero();
  }
  return sum + likelihood(positions);
}

/// Through dn = (dN − n (n·dN)) / s for n = N / s, s² = ‖N‖² + const, and N = (b − a) × (c − a).
void DiebelEnergy::add_prior_gradient(const std::vector<Vec3>& positions, std::vector<Vec3>& gradient) const {
  for (std::size_t f = 0; f < normals_.size(); ++f) {
    const auto [a, b, c] = surface_.faces[f];
    const Vec3& n = normals_[f];
    const Vec3 along = (normal_gradient_[f] - n.dot(normal_gradient_[f]) * n) / double_areas_[f];
    const Vec3 at_b = (positions[c] - positions[a]).cross(along);
    const Vec3 at_c = along.cross(positions[b] - positions[a]);
    gradient[a] -= at_b + at_c;
    gradient[b] += at_b;
    gradient[c] += at_c;
  }
}

ClassicalStep make_step(Surface& surface, const DiebelOptions& options) {
  const auto diebel = std::make_shared<Diebel>(surface, options.likelihood_weight);
  return [diebel] { return (*diebel)(); };
}

}  // namespace crease
