#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/thread_team.h"
#include "core/geometry/lanes.h"
#include "core/graduated/flat_mesh.h"

namespace crease {

/// Eight numbers in sixteen bits each, in steps of 1/`steps`; what is too large is the largest. In single precision the
/// features of a million faces would take 320 MB.
template <int steps>
class PackedLanes {
 public:
  CREASE_LANES_INLINE void store(const Lanes& numbers) {
    const Lanes many = numbers * static_cast<float>(steps),
                above = many > -kLargest ? many : -kLargest + Lanes{};  // no number: the least
    const Lanes scaled = above < kLargest ? above : kLargest + Lanes{};
    const Lanes rounded = scaled + (scaled < 0 ? -0.5F + Lanes{} : 0.5F + Lanes{});
    numbers_ = __builtin_convertvector(__builtin_convertvector(rounded, IntLanes), ShortLanes);
  }
  CREASE_LANES_INLINE Lanes load() const {
    return __builtin_convertvector(__builtin_convertvector(numbers_, IntLanes), Lanes) *
           (1 / static_cast<float>(steps));
  }

 private:
  static constexpr float kLargest = 32767;
  ShortLanes numbers_{};
};

/// How a result came about.
struct DescentSight {
  double noise_sigma = 0;         ///< in ℓ, as it was estimated
  double correlation_length = 0;  ///< of the noise, in edges
  double isotropy = 0;            ///< of the noise: 0 along the normals, 1 in all directions
  double exponent = 1;            ///< of the potential, in the end
  double weight = 0;              ///< of the likelihood, in units of one over the noise variance

  static constexpr std::size_t kFeatures = 5;
  /// As the networks read it.
  std::array<float, kFeatures> features() const;
};

/// What the regression of normals sees of eight faces, one in each lane. Normals of the upload, of the result, and
/// of a reference are averaged over ever wider neighbourhoods; joint bilateral weights [Petschnigg et al. 2004] keep
/// the averages on their side of the ridges of the result. `x` and `y` are the parts of these averages within the plane
/// of the face, in a frame that is arbitrary: what is learnt from them must not depend on it.
struct NormalFeatures {
  static constexpr std::size_t kFaces = kLaneCount;

  /// Averages with weights that fall off over a `width` in ‖n_i − n_j‖, after so many rounds of averaging over the
  /// faces next to each; 0 for none.
  struct Averaging {
    float width;
    std::array<int, 6> rounds;
  };
  static constexpr std::array<Averaging, 3> kAveragings{
      {{0.15F, {1, 4, 16}}, {0.4F, {1, 4, 16}}, {10, {1, 2, 4, 8, 16, 32}}}};
  static constexpr std::size_t kAverages = [] {
    std::size_t count = 0;
    for (const Averaging& averaging : kAveragings) {
      for (const int rounds : averaging.rounds) count += rounds > 0 ? 2 : 0;
    }
    return count;
  }();
  /// Of the reference there are averages after fewer rounds, 0 for its normals themselves.
  static constexpr float kReferenceWidth = 0.4F;
  static constexpr std::array<int, 3> kReferenceRounds{0, 1, 4};
  /// The normal of the upload, the averages, those of the reference.
  static constexpr std::size_t kVectors = 1 + kAverages + kReferenceRounds.size();
  /// How much each average is averaged out, DescentSight, area, how much those of the reference are averaged out.
  static constexpr std::size_t kScalars = kAverages + DescentSight::kFeatures + 1 + kReferenceRounds.size() - 1;

  std::array<PackedLanes<32'000>, kVectors> x, y;   ///< −1 to 1
  std::array<PackedLanes<1000>, kScalars> scalars;  ///< −32 to 32
};

/// A face's unit normal, or zero for a face without area, and two axes of its plane.
struct FaceFrame {
  std::array<float, 3> normal{}, first{}, second{};
};
FaceFrame face_frame(const FlatMesh& mesh, std::span<const float> positions, std::size_t face);

/// Unit normals of all faces where the vertices are at `positions`; zero for faces without an area.
FlatVectors face_normals(const FlatMesh& mesh, std::span<const float> positions, ThreadTeam& team);

/// Of all faces; lanes beyond the last face have no meaning. `reference` has other unit normals of the faces, or is
/// empty: then those of `positions` stand in for it. The same bits for any number of threads.
std::vector<NormalFeatures> normal_features(const FlatMesh& mesh, std::span<const float> positions,
                                            std::span<const float> reference, const DescentSight& sight,
                                            ThreadTeam& team);

}  // namespace crease
