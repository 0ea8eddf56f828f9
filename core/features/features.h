#pragma once

#include <vector>

#include "core/features/ridge_lines.h"
#include "core/features/segmentation.h"
#include "core/features/vertex_classes.h"

namespace crease {

struct FeatureOptions {
  VertexClassOptions classes;
  SegmentOptions segments;
};

/// What the ridge labels say of the vertices, the faces and the ridges as lines (§5).
struct Features {
  std::vector<VertexClass> classes;  ///< per vertex
  std::vector<Index> corners;        ///< the vertices of class corner, ascending
  std::vector<Index> segments;       ///< per face; numbered from 0 in the order of their first faces
  Index segment_count = 0;
  std::vector<RidgeLine> ridge_lines;
};

/// `labels` per edge of the topology of `mesh`, in [0, 1]; `positions` replace those of the mesh. Any mesh will do.
/// The same input gives the same bits.
Features find_features(const Mesh& mesh, const Topology& topology, const std::vector<Vec3>& positions,
                       const std::vector<double>& labels, const FeatureOptions& options = {});

}  // namespace crease
