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

/// Vertex classes, segments and ridge lines that follow from the ridge labels (§5).
struct Features {
  std::vector<VertexClass> classes;  ///< per vertex
  std::vector<Index> corners;        ///< the vertices of class corner, ascending
  std::vector<Index> segments;       ///< per face; numbered from 0 in the order of their first faces
  Index segment_count = 0;
  std::vector<RidgeLine> ridge_lines;
  std::vector<double> dihedral_rad;  ///< signed angles of the edges
};

/// Finds the features of any mesh. `labels` are in [0, 1], one per edge of `topology`. `positions` replace those of
/// `mesh`. The same input gives the same bits, for any number of threads.
Features find_features(const Mesh& mesh, const Topology& topology, const std::vector<Vec3>& positions,
                       const std::vector<double>& labels, const FeatureOptions& options = {},
                       ThreadTeam& team = calling_thread());

}  // namespace crease
