#include "core/job_surface.h"

namespace crease {

JobSurface::JobSurface(const CheckedInput& input, double tolerance) : input_(input) {
  if (tolerance > 0) {
    WeldFacts found;
    nearby_ = weld(input.mesh, tolerance * input.facts.mean_edge_length, found);
    welded_nearby_ = found.coincident_vertices.count - input.facts.coincident_vertices;
  }
  const std::optional<WeldedMesh>& welded = tolerance > 0 ? nearby_ : input.welded;
  if (!welded) return;
  welded_ = &*welded;
  edge_of_ = welded_edges(input.mesh, input.topology, *welded_);
  if (input.weights.empty()) return;
  for (const Index vertex : welded_->upload_vertex) weights_.push_back(input.weights[vertex]);
}

std::vector<Vec3> JobSurface::upload_positions(std::vector<Vec3> positions) const {
  if (welded_ == nullptr) return positions;
  std::vector<Vec3> result;
  result.reserve(welded_->vertex_of.size());
  for (std::size_t v = 0; v < welded_->vertex_of.size(); ++v) {
    const Index vertex = welded_->vertex_of[v];
    result.push_back(vertex == kNone ? input_.mesh.positions[v] : positions[vertex]);
  }
  return result;
}

std::vector<double> JobSurface::upload_edges(std::vector<double> values) const {
  if (welded_ == nullptr) return values;
  std::vector<double> result;
  result.reserve(edge_of_.size());
  for (const Index edge : edge_of_) result.push_back(edge == kNone ? 0 : values[edge]);
  return result;
}

std::vector<double> JobSurface::upload_vertices(std::vector<double> values) const {
  if (welded_ == nullptr) return values;
  std::vector<double> result;
  result.reserve(welded_->vertex_of.size());
  for (const Index vertex : welded_->vertex_of) result.push_back(vertex == kNone ? 0 : values[vertex]);
  return result;
}

Features JobSurface::upload_features(Features features) const {
  if (welded_ == nullptr) return features;
  Features result;
  result.segment_count = features.segment_count;
  for (const Index vertex : welded_->vertex_of) {
    result.classes.push_back(vertex == kNone ? VertexClass::kSmooth : features.classes[vertex]);
  }
  for (std::size_t face = 0; face < welded_->face_of.size(); ++face) {
    result.segments.push_back(segment_of(face, features.segments));
  }
  for (const Index vertex : features.corners) result.corners.push_back(welded_->upload_vertex[vertex]);
  result.ridge_lines = std::move(features.ridge_lines);
  for (RidgeLine& line : result.ridge_lines) {
    for (Index& vertex : line.vertices) vertex = welded_->upload_vertex[vertex];
  }
  return result;
}

Index JobSurface::segment_of(std::size_t face, const std::vector<Index>& segments) const {
  if (welded_->face_of[face] != kNone) return segments[welded_->face_of[face]];
  for (const Index edge : input_.topology.face_edges[face]) {
    if (edge != kNone && edge_of_[edge] != kNone) return segments[welded_->topology.edge_faces[edge_of_[edge]][0]];
  }
  for (const Index corner : input_.mesh.triangles[face]) {
    const Index vertex = welded_->vertex_of[corner];
    if (vertex != kNone) return segments[welded_->topology.vertex_faces[vertex].front()];
  }
  return kNone;
}

}  // namespace crease
