#include "core/energy/gradient.h"

#include <Eigen/Geometry>

namespace crease {
namespace {

/// The corners at each vertex, numbered face by face within the first corners, then the second, then the third.
IndexRows corners_of_vertices(const Surface& surface) {
  const std::size_t faces = surface.faces.size(), vertices = surface.positions.size();
  IndexRows rows;
  rows.starts.assign(vertices + 1, 0);
  for (const Triangle& face : surface.faces) {
    for (const Index v : face) ++rows.starts[v + 1];
  }
  for (std::size_t v = 0; v < vertices; ++v) rows.starts[v + 1] += rows.starts[v];
  rows.items.resize(3 * faces);
  std::vector<Index> next(rows.starts.begin(), rows.starts.end() - 1);
  for (std::size_t f = 0; f < faces; ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      rows.items[next[surface.faces[f][k]]++] = static_cast<Index>(k * faces + f);
    }
  }
  return rows;
}

template <typename Real>
void store(std::vector<Real>& flat, std::size_t i, const Eigen::Matrix<Real, 3, 1>& vector) {
  const std::size_t count = flat.size() / 3;
  for (Eigen::Index axis = 0; axis < 3; ++axis) flat[static_cast<std::size_t>(axis) * count + i] = vector[axis];
}

}  // namespace

template <typename Real>
EnergyGradient<Real>::EnergyGradient(const Field& field, const EnergyTerms& terms)
    : field_(field),
      terms_(terms),
      neighbors_(field.faces.size()),
      edges_(field.faces.size()),
      corners_(corners_of_vertices(field)),
      normals_(3 * field.faces.size()),
      inverse_lengths_(field.faces.size()),
      stiffness_(field.topology.edges.size() + 1, 0),
      by_corner_(9 * field.faces.size()) {
  const auto none = static_cast<Index>(field.topology.edges.size());
  for (Index f = 0; f < field.faces.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Index edge = field.topology.face_edges[f][k], other = field.topology.face_across(f, edge);
      neighbors_[f][k] = other != kNone ? other : f;
      edges_[f][k] = other != kNone ? edge : none;
    }
  }
}

template <typename Real>
double EnergyGradient<Real>::operator()(const Weights& weights, std::span<const Real> positions,
                                        std::span<Real> gradient, ThreadTeam& team) {
  const View points = view(positions);
  update_normals(points, team);
  const double of_edges = edge_pass(weights, team);
  const double of_faces = face_pass(weights, points, team);
  return of_edges + of_faces + vertex_pass(weights, points, gradient, team);
}

template <typename Real>
void EnergyGradient<Real>::update_normals(View points, ThreadTeam& team) {
  team.run(field_.faces.size(), kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t f = begin; f < end; ++f) {
      const auto [a, b, c] = field_.faces[f];
      const Vector from = points(a);
      const Vector area = (points(b) - from).cross(points(c) - from);
      const Real inverse = 1 / std::sqrt(area.squaredNorm() + kFadingArea * kFadingArea);
      inverse_lengths_[f] = inverse;
      store<Real>(normals_, f, area * inverse);
    }
  });
}

template <typename Real>
double EnergyGradient<Real>::edge_pass(const Weights& weights, ThreadTeam& team) {
  const Topology& topology = field_.topology;
  const View normals = view(normals_);
  const std::size_t count = topology.edges.size();
  double value = 0;
  std::fill(stiffness_.begin(), stiffness_.end(), Real{0});
  terms_.for_each([&]<typename Term>(const Term& term) {
    if constexpr (requires { term.at(Index{}, Real{}); }) {
      const auto twice_weight = static_cast<Real>(2 * weights.of<Term>());
      value += weights.of<Term>() * block_sum<double>(count, team, [&](std::size_t e) {
                 if (!topology.is_interior(e)) return Real{0};
                 const auto [f0, f1] = topology.edge_faces[e];
                 const Potential<Real> potential =
                     term.at(static_cast<Index>(e), (normals(f0) - normals(f1)).squaredNorm());
                 stiffness_[e] += twice_weight * potential.slope;
                 return potential.value;
               });
    }
  });
  return value;
}

/// ∂E/∂n of a face.
template <typename Real>
CREASE_LANES_INLINE typename EnergyGradient<Real>::Vector EnergyGradient<Real>::by_normal(const Weights& weights,
                                                                                          std::size_t face) const {
  const View normals = view(normals_);
  const Vector normal = normals(face);
  Vector gradient = Vector::Zero();
  for (std::size_t k = 0; k < 3; ++k) {
    gradient += stiffness_[edges_[face][k]] * (normal - normals(neighbors_[face][k]));
  }
  terms_.for_each([&]<typename Term>(const Term& term) {
    if constexpr (requires { term.by_normal(normals, Index{}); }) {
      gradient += static_cast<Real>(weights.of<Term>()) * term.by_normal(normals, static_cast<Index>(face));
    }
  });
  return gradient;
}

/// Through dn = (dN − n (n·dN)) / s for n = N / s, s² = ‖N‖² + const, and N = (b − a) × (c − a).
template <typename Real>
double EnergyGradient<Real>::face_pass(const Weights& weights, View points, ThreadTeam& team) {
  const View normals = view(normals_);
  const std::size_t count = field_.faces.size();
  team.run(count, kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t f = begin; f < end; ++f) {
      const auto [a, b, c] = field_.faces[f];
      const Vector normal = normals(f), gradient = by_normal(weights, f);
      const Vector by_area = (gradient - normal.dot(gradient) * normal) * inverse_lengths_[f];
      const Vector from = points(a);
      const Vector by_b = (points(c) - from).cross(by_area), by_c = by_area.cross(points(b) - from);
      store<Real>(by_corner_, f, -by_b - by_c);
      store<Real>(by_corner_, count + f, by_b);
      store<Real>(by_corner_, 2 * count + f, by_c);
    }
  });
  double value = 0;
  terms_.for_each([&]<typename Term>(const Term& term) {
    if constexpr (requires { term.at_normals(normals, Index{}); }) {
      value += weights.of<Term>() * block_sum<double>(count, team, [&](std::size_t f) {
                 return term.at_normals(normals, static_cast<Index>(f));
               });
    }
  });
  return value;
}

template <typename Real>
double EnergyGradient<Real>::vertex_pass(const Weights& weights, View points, std::span<Real> gradient,
                                         ThreadTeam& team) {
  const View by_corner = view(by_corner_);
  const std::size_t count = gradient.size() / 3;
  team.run(count, kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t v = begin; v < end; ++v) {
      Vector sum = Vector::Zero();
      for (const Index corner : corners_[v]) sum += by_corner(corner);
      for (std::size_t axis = 0; axis < 3; ++axis) gradient[axis * count + v] = sum[static_cast<Eigen::Index>(axis)];
    }
  });
  double value = 0;
  terms_.for_each([&]<typename Term>(const Term& term) {
    if constexpr (requires { term.at_positions(points, Index{}); }) {
      const auto weight = static_cast<Real>(weights.of<Term>());
      value += weights.of<Term>() * block_sum<double>(count, team, [&](std::size_t v) {
                 const Vector by_position = weight * term.by_position(points, static_cast<Index>(v));
                 for (std::size_t axis = 0; axis < 3; ++axis) {
                   gradient[axis * count + v] += by_position[static_cast<Eigen::Index>(axis)];
                 }
                 return term.at_positions(points, static_cast<Index>(v));
               });
    }
  });
  return value;
}

template class EnergyGradient<float>;
template class EnergyGradient<double>;

}  // namespace crease
