#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "core/base/thread_team.h"
#include "core/geometry/lanes.h"
#include "core/graduated/flat_mesh.h"
#include "core/regression/spokes.h"

namespace crease {

/// What is seen of an edge by walking on along the ridge that it is part of, in both directions. Noise that hides how
/// far the upload turns at a single edge averages out along a ridge: in sums of area vectors over the faces on either
/// side, and in how far the vertices of the ridge lie outside of what was measured.
class RidgeWalks {
 public:
  static constexpr std::array<std::size_t, 2> kSteps{8, 32};  ///< in each direction
  /// After so many steps each: the turn ‖n_i − n_j‖ of the upload, that of the result, and the mean distance in ℓ by
  /// which the result is sharper than the upload. Then the logarithm of the number of vertices. Of an edge that nothing
  /// goes on from, the upload tells too little: the turn of the result stands for both, and no distance.
  static constexpr std::size_t kFeatures = 3 * kSteps.size() + 1;
  using Features = std::array<float, kFeatures>;

  /// `positions` are those of the result, `turns` how far each edge turns there, `along` the directions of the edges.
  /// All must outlive the object.
  RidgeWalks(const FlatMesh& mesh, std::span<const float> positions, const std::vector<float>& turns,
             const std::vector<LaneRow>& along, const Spokes& spokes, ThreadTeam& team);

  Features features(std::size_t edge) const;

 private:
  /// Area vectors of the faces on both sides of a piece of a ridge, and how far its vertices were moved outwards.
  struct Piece {
    std::array<HalfLanes, 2> upload{}, result{};
    float moved = 0, vertices = 0;
  };
  struct Walk;

  static Features of_single(float turn);
  Piece piece_of(std::size_t edge) const;
  /// Along the mean of the normals on both sides.
  float moved_outwards(const Piece& at, std::size_t vertex) const;
  bool is_convex(std::size_t edge) const;
  /// The edge that goes on straightest and turns most beyond end number `side`; none if the ridge ends there.
  std::optional<std::size_t> next(std::size_t edge, std::size_t side) const;

  const FlatMesh& mesh_;
  std::span<const float> positions_;
  const std::vector<float>& turns_;
  const std::vector<LaneRow>& along_;
  const Spokes& spokes_;
  std::vector<LaneRow> of_upload_, of_result_;  ///< area vectors of the faces
};

}  // namespace crease
