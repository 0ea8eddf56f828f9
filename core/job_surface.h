#pragma once

#include <optional>
#include <vector>

#include "core/features/features.h"
#include "core/job.h"

namespace crease {

/// The surface that a job smooths, and the way of its results to the upload: every vertex that was welded gets the
/// result of the one that it was welded to, and every edge the label of the edge that it became.
class JobSurface {
 public:
  /// `input` must outlive this. `tolerance` is in mean edge lengths.
  JobSurface(const CheckedInput& input, double tolerance);

  const Mesh& mesh() const { return welded_ == nullptr ? input_.mesh : welded_->mesh; }
  const Topology& topology() const { return welded_ == nullptr ? input_.topology : welded_->topology; }
  const std::vector<double>& weights() const { return welded_ == nullptr ? input_.weights : weights_; }
  /// The number of vertices that were welded to others that are near, but not at the same position.
  std::uint32_t welded_nearby() const { return welded_nearby_; }

  /// Values per vertex or edge of the surface as those of the upload. Vertices that were left out stay where the upload
  /// has them; edges that the surface does not have get 0.
  std::vector<Vec3> upload_positions(std::vector<Vec3> positions) const;
  std::vector<double> upload_edges(std::vector<double> values) const;
  /// The same for numbers of vertices; 0 for those that were left out.
  std::vector<double> upload_vertices(std::vector<double> values) const;
  /// Features of the surface as those of the upload. A face that was left out is in the segment of its neighbours, or
  /// in segment kNone.
  Features upload_features(Features features) const;

 private:
  Index segment_of(std::size_t face, const std::vector<Index>& segments) const;

  const CheckedInput& input_;
  std::optional<WeldedMesh> nearby_;    ///< with a tolerance
  const WeldedMesh* welded_ = nullptr;  ///< null if the upload itself is smoothed
  std::vector<Index> edge_of_;          ///< per edge of the upload
  std::vector<double> weights_;         ///< per vertex of `welded_`
  std::uint32_t welded_nearby_ = 0;
};

}  // namespace crease
