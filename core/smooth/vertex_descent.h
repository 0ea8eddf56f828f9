#pragma once

#include <optional>
#include <vector>

#include "core/smooth/field.h"
#include "core/smooth/ridge_straightness.h"
#include "core/smooth/state_archive.h"

namespace crease {

/// E as a function of the positions while the labels stand still, with its gradient. ‖n_i − n_j‖ of the square-root
/// potential is rounded off near zero, and the normal of a face fades to zero with its area, so that E is
/// differentiable everywhere.
class VertexEnergy {
 public:
  /// The field must outlive the object.
  explicit VertexEnergy(Field& field);

  /// Takes over the weights and the field's labels.
  void set_model(const EnergyModel& model, ThreadTeam& team);
  /// E at the field's positions.
  double value(ThreadTeam& team);
  /// The gradient there, after value().
  void gradient(std::vector<Vec3>& gradient, ThreadTeam& team);

 private:
  float rounding() const;
  Vec3 normal_gradient(Index face) const;
  Vec3 second_difference(Index face) const;

  Field& field_;
  EnergyModel model_;
  std::optional<RidgeStraightness> ridge_straightness_;
  std::vector<Vec3> normals_;         ///< faded
  std::vector<double> lengths_;       ///< of the normals before they were divided by it
  std::vector<Vec3> area_gradients_;  ///< ∂E/∂(b − a) × (c − a), per face
};

/// Nonlinear conjugate gradients [Polak & Ribière 1969, restarted where β < 0] on the positions, one step after each
/// pass over the labels: the vertex process of the mean-field solver.
class VertexDescent {
 public:
  explicit VertexDescent(Field& field);

  /// One step to lower energy; none where there is none to be found. Normals are kept up to date.
  void run(const EnergyModel& model, ThreadTeam& team);
  void exchange(StateArchive& archive);

 private:
  double try_step(double length, ThreadTeam& team);
  void descend(double value, double slope, ThreadTeam& team);
  double first_length() const;

  Field& field_;
  VertexEnergy energy_;
  std::vector<Vec3> from_, gradient_, previous_, search_;
  double last_decrease_ = 0;
};

}  // namespace crease
