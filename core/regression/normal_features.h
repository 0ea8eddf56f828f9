#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/base/thread_team.h"
#include "core/geometry/lanes.h"
#include "core/graduated/flat_mesh.h"

namespace crease {

/// What the regression of normals sees of eight faces, one in each lane. Normals of the upload and of the result are
/// averaged over ever wider neighbourhoods; joint bilateral weights [Petschnigg et al. 2004] keep the averages on their
/// side of the ridges of the result. `x` and `y` are the parts of these averages within the plane of the face, in a
/// frame that is arbitrary: what is learnt from them must not depend on it.
struct alignas(32) NormalFeatures {
  static constexpr std::size_t kFaces = 8;

  /// Averages with weights that fall off over a `width` in ‖n_i − n_j‖, after so many rounds of averaging over the
  /// faces next to each; 0 for none.
  struct Averaging {
    float width;
    std::array<int, 6> rounds;
  };
  static constexpr std::array<Averaging, 3> kAveragings{
      {{0.15F, {1, 4, 16}}, {0.4F, {1, 4, 16}}, {10, {1, 2, 4, 8, 16, 32}}}};
  static constexpr std::size_t kAverages = 2 * 12;
  static constexpr std::size_t kVectors = kAverages + 1;  ///< and the normal of the upload itself
  static constexpr std::size_t kScalars = kAverages + 6;  ///< how much each is averaged out; area; DescentSight

  LaneArray<kVectors> x, y;
  LaneArray<kScalars> scalars;
};

/// How a result came about.
struct DescentSight {
  double noise_sigma = 0;         ///< in ℓ, as it was estimated
  double correlation_length = 0;  ///< of the noise, in edges
  double isotropy = 0;            ///< of the noise: 0 along the normals, 1 in all directions
  double exponent = 1;            ///< of the potential, in the end
  double weight = 0;              ///< of the likelihood, in units of one over the noise variance
};

/// A face's unit normal, or zero for a face without area, and two axes of its plane.
struct FaceFrame {
  std::array<float, 3> normal{}, first{}, second{};
};
FaceFrame face_frame(const FlatMesh& mesh, std::span<const float> positions, std::size_t face);

/// Of all faces; lanes beyond the last face have no meaning. The same bits for any number of threads.
std::vector<NormalFeatures> normal_features(const FlatMesh& mesh, std::span<const float> positions,
                                            const DescentSight& sight, ThreadTeam& team);

}  // namespace crease
