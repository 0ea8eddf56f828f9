#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/base/thread_team.h"
#include "core/geometry/lanes.h"
#include "core/graduated/flat_mesh.h"
#include "core/regression/normal_features.h"
#include "core/regression/ridge_walks.h"
#include "core/regression/spokes.h"

namespace crease {

/// What the regression of labels sees of edges: how far the normals of the faces on both sides differ in the result, in
/// the reference, where the regression of normals wants them, and in the upload, and the same of the edges around and
/// of the ridge that the edge is part of.
class LabelFeatures {
 public:
  static constexpr std::size_t kCount = 17 + RidgeWalks::kFeatures + DescentSight::kFeatures;
  using Block = LaneArray<kCount>;  ///< of eight edges, one in each lane

  /// `positions` are those of the result; `reference` may be empty, and so may `normals`, three numbers for each face,
  /// which the regression wants. All must outlive the object.
  LabelFeatures(const FlatMesh& mesh, std::span<const float> positions, std::span<const float> reference,
                std::span<const float> normals, const DescentSight& sight, ThreadTeam& team);
  LabelFeatures(const LabelFeatures&) = delete;  // the walks refer to what it has
  LabelFeatures& operator=(const LabelFeatures&) = delete;

  /// Of edges 8 · `block` and on; lanes beyond the last edge have no meaning.
  Block block(std::size_t block) const;

 private:
  enum Source : std::size_t { kOfResult, kOfReference, kOfWanted, kOfUpload };
  static constexpr std::size_t kSources = 4;
  static constexpr std::array kTelling{kOfResult, kOfWanted};

  void put_edge(std::size_t edge, std::size_t lane, Block& block) const;
  /// In each of kTelling, the largest turn of an edge that goes on from this one beyond its end number `side`, by the
  /// cosine between them.
  std::array<float, 2> turns_beyond(std::size_t edge, std::size_t side) const;

  const FlatMesh& mesh_;
  std::array<std::vector<float>, kSources> turns_;  ///< ‖n_i − n_j‖ per edge
  std::vector<LaneRow> along_;                      ///< unit directions of the edges
  std::vector<float> lengths_;                      ///< log
  Spokes spokes_;
  RidgeWalks walks_;
  std::array<float, DescentSight::kFeatures> sight_;
};

}  // namespace crease
