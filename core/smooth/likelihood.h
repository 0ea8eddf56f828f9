#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/options/options.h"

namespace crease {

struct Field;

/// Σ_v w_v U_L(v), how improbable the positions are as the truth behind the measured ones (§3.1), without the weight α.
class Likelihood {
 public:
  /// Of `measured` positions in mean edge lengths; `weights` per vertex, or empty for 1 everywhere.
  Likelihood(const std::vector<Vec3>& measured, const std::vector<Triangle>& faces, const MrfOptions& options,
             std::span<const double> weights);

  /// w_v U_L(v).
  double energy(const Field& field, Index vertex) const;

  /// The sum after `vertex` has moved to `to`, minus the sum now.
  inline double change(const Field& field, Index vertex, const Vec3& to) const;

  /// The derivative of the sum by the position of `vertex`.
  Vec3 gradient(const Field& field, Index vertex) const;

 private:
  /// The volume that a vertex and its neighbours have swept, and the area that swept it.
  struct Flow {
    double volume = 0, area = 0;
    double square() const { return area > 0 ? volume * volume / (area * area) : 0; }
  };

  double general_change(const Field& field, Index vertex, const Vec3& to) const;
  Vec3 gradient_alone(Index vertex, const Vec3& displacement) const;
  double alone(Index vertex, const Vec3& displacement) const;
  Flow flow(const Field& field, Index vertex) const;
  double flow_change(const Field& field, Index vertex, const Vec3& step) const;
  Vec3 direction(Index vertex) const { return fixed_direction_ ? *fixed_direction_ : vertex_normals_[vertex]; }

  LikelihoodKind kind_;
  double width_, across_, volume_weight_;
  std::vector<double> weights_;
  std::optional<Vec3> fixed_direction_;
  std::vector<Vec3> vertex_areas_;    ///< a third of the area vectors of its faces, for the volume
  std::vector<Vec3> vertex_normals_;  ///< the same at unit length
};

}  // namespace crease
