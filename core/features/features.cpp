#include "core/features/features.h"

namespace crease {

Features find_features(const Mesh& mesh, const Topology& topology, const std::vector<Vec3>& positions,
                       const std::vector<double>& labels, const FeatureOptions& options, ThreadTeam& team) {
  Features features;
  features.dihedral_rad = signed_dihedral_angles(mesh, topology, positions, team);
  features.classes = classify_vertices(topology, positions, labels, options.classes, team);
  for (Index v = 0; v < features.classes.size(); ++v) {
    if (features.classes[v] == VertexClass::kCorner) features.corners.push_back(v);
  }
  Segmentation segmentation = segment_faces(
      SegmentField(mesh, topology, positions, labels, features.dihedral_rad, options.segments, team), team);
  features.segments = std::move(segmentation.segments);
  features.segment_count = segmentation.count;
  features.ridge_lines = trace_ridges(topology, positions, labels, features.dihedral_rad, features.classes);
  return features;
}

}  // namespace crease
