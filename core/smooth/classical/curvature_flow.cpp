#include <Eigen/Geometry>
#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "core/smooth/classical/methods.h"

namespace crease {
namespace {

/// Floor of twice an area in ℓ², below which a face weighs as one of that area: slivers would have weights without end.
constexpr double kSmallArea = 1e-4;
constexpr double kTolerance = 1e-8;
constexpr int kMostSolverSteps = 1000;

/// Implicit steps of dx/dt = w Δx [Desbrun et al. 1999]: with the lumped areas A, the cotangent stiffness S and the
/// speed w = s², the displacement s y solves (A + h s S s) y = −h s S x, which is symmetric and positive for any w ≥ 0.
class CurvatureFlow {
 public:
  /// A threshold of 0 means speed 1 everywhere.
  CurvatureFlow(PinnedSurface& surface, double step, double threshold)
      : surface_(surface), step_(step), threshold_(threshold), row_(surface.positions.size(), kNone) {
    for (const Index v : surface.movable) row_[v] = rows_++;
    flow_.resize(rows_, 3);
    solver_.setTolerance(kTolerance);
    solver_.setMaxIterations(kMostSolverSteps);
  }

  bool operator()() {
    measure_faces();
    measure_vertices();
    assemble();
    solver_.compute(system_);
    const Eigen::MatrixX3d y = solver_.solve(flow_);
    if (!y.allFinite()) return false;
    for (const Index v : surface_.movable) surface_.positions[v] += root_speed_[v] * y.row(row_[v]).transpose();
    return true;
  }

 private:
  /// Halved cotangents opposite each edge, a third of the faces' areas and the angles at each vertex.
  void measure_faces() {
    weight_.assign(surface_.topology.edges.size(), 0);
    area_.assign(surface_.positions.size(), 0);
    angle_.assign(surface_.positions.size(), 0);
    for (std::size_t f = 0; f < surface_.faces.size(); ++f) {
      const double double_area = surface_.area_vector(f).norm();
      for (std::size_t k = 0; k < 3; ++k) measure_corner(f, k, double_area);
    }
  }

  void measure_corner(std::size_t face, std::size_t corner, double double_area) {
    const Triangle& triangle = surface_.faces[face];
    const Index v = triangle[corner];
    const Vec3& here = surface_.positions[v];
    const double dot = (surface_.positions[triangle[(corner + 1) % 3]] - here)
                           .dot(surface_.positions[triangle[(corner + 2) % 3]] - here);
    area_[v] += double_area / 6;
    angle_[v] += std::atan2(double_area, dot);
    const Index opposite = opposite_edge(face, v);
    if (opposite != kNone) weight_[opposite] += dot / (2 * std::max(double_area, kSmallArea));
  }

  Index opposite_edge(std::size_t face, Index vertex) const {
    for (const Index e : surface_.topology.face_edges[face]) {
      if (e == kNone) return kNone;
      const Edge& edge = surface_.topology.edges[e];
      if (edge.v0 != vertex && edge.v1 != vertex) return e;
    }
    return kNone;
  }

  /// −S x into flow_, and the speed at each movable vertex.
  void measure_vertices() {
    root_speed_.assign(surface_.positions.size(), 0);
    flow_.setZero();
    for (std::size_t e = 0; e < weight_.size(); ++e) {
      const auto [v0, v1] = surface_.topology.edges[e];
      const Vec3 pull = weight_[e] * (surface_.positions[v1] - surface_.positions[v0]);
      if (row_[v0] != kNone) flow_.row(row_[v0]) += pull.transpose();
      if (row_[v1] != kNone) flow_.row(row_[v1]) -= pull.transpose();
    }
    for (const Index v : surface_.movable) {
      area_[v] = std::max(area_[v], kSmallArea);
      root_speed_[v] = threshold_ > 0 ? std::sqrt(speed(v)) : 1;
    }
  }

  /// 1 where the surface is smooth; on a ridge the ratio of the smaller principal curvature to the mean curvature, so
  /// that it only flows along itself; 0 at corners [Meyer et al. 2003]. A ratio below 0, which would flow
  /// backwards, is taken as 0.
  double speed(Index v) const {
    const double mean = flow_.row(row_[v]).norm() / (2 * area_[v]);
    const double gaussian = (2 * std::numbers::pi - angle_[v]) / area_[v];
    const double spread = std::sqrt(std::max(mean * mean - gaussian, 0.0));
    const double larger = mean + spread, smaller = mean - spread;
    if (larger <= threshold_) return 1;
    if (smaller > threshold_) return 0;
    return std::abs(smaller) < mean ? std::max(smaller / mean, 0.0) : 1;
  }

  void assemble() {
    entries_.clear();
    for (const Index v : surface_.movable) {
      entries_.emplace_back(row_[v], row_[v], area_[v]);
      flow_.row(row_[v]) *= step_ * root_speed_[v];
    }
    for (std::size_t e = 0; e < weight_.size(); ++e) {
      const auto [v0, v1] = surface_.topology.edges[e];
      const double weight = step_ * weight_[e];
      for (const Index v : {v0, v1}) {
        if (row_[v] != kNone) entries_.emplace_back(row_[v], row_[v], weight * root_speed_[v] * root_speed_[v]);
      }
      if (row_[v0] == kNone || row_[v1] == kNone) continue;
      const double coupling = -weight * root_speed_[v0] * root_speed_[v1];
      entries_.emplace_back(row_[v0], row_[v1], coupling);
      entries_.emplace_back(row_[v1], row_[v0], coupling);
    }
    system_.resize(rows_, rows_);
    system_.setFromTriplets(entries_.begin(), entries_.end());
  }

  PinnedSurface& surface_;
  double step_, threshold_;
  std::vector<Index> row_;  ///< of the system, per vertex; kNone where it does not move
  Index rows_ = 0;
  std::vector<double> weight_;                     ///< per edge
  std::vector<double> area_, angle_, root_speed_;  ///< per vertex
  Eigen::MatrixX3d flow_;
  std::vector<Eigen::Triplet<double, Index>> entries_;
  Eigen::SparseMatrix<double> system_;
  Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower | Eigen::Upper> solver_;
};

ClassicalStep make_flow(PinnedSurface& surface, double step, double threshold) {
  const auto flow = std::make_shared<CurvatureFlow>(surface, step, threshold);
  return [flow] { return (*flow)(); };
}

}  // namespace

ClassicalStep make_step(PinnedSurface& surface, const MeanCurvatureFlowOptions& options) {
  return make_flow(surface, options.step, 0);
}

ClassicalStep make_step(PinnedSurface& surface, const AnisotropicFlowOptions& options) {
  return make_flow(surface, options.step, options.normal_width);
}

}  // namespace crease
