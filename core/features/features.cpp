#include "core/features/features.h"

namespace crease {

Features find_features(const Mesh& mesh, const Topology& topology, const std::vector<Vec3>& positions,
                       const std::vector<double>& labels, const FeatureOptions& options) {
  Features features;
  features.classes = classify_vertices(topology, positions, labels, options.classes);
  for (Index v = 0; v < features.classes.size(); ++v) {
    if (features.classes[v] == VertexClass::kCorner) features.corners.push_back(v);
  }
  Segmentation segmentation = segment_faces(mesh, topology, positions, labels, options.segments);
  features.segments = std::move(segmentation.segments);
  features.segment_count = segmentation.count;
  features.ridge_lines =
      trace_ridges(topology, positions, labels, signed_dihedral_angles(mesh, topology, positions), features.classes);
  return features;
}

}  // namespace crease
