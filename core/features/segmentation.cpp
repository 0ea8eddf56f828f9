#include "core/features/segmentation.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/features/graph_cut.h"
#include "core/features/segment_moves.h"
#include "core/mesh/face_vectors.h"

namespace crease {
namespace {

constexpr double kLeastArea = 0.1;

std::vector<double> face_areas(const Mesh& mesh, const std::vector<Vec3>& positions, ThreadTeam& team) {
  std::vector<double> areas(mesh.triangles.size());
  for_each(areas.size(), team,
           [&](std::size_t face) { areas[face] = area_vector(positions, mesh.triangles[face]).norm() / 2; });
  return areas;
}

/// Rings of vertices between each vertex and the nearest ridge, at most `most`.
std::vector<std::uint32_t> count_rings(const Topology& topology, const std::vector<double>& labels,
                                       std::uint32_t most) {
  std::vector<std::uint32_t> rings(topology.vertex_edges.size(), most);
  std::vector<Index> queue;
  for (Index e = 0; e < topology.edges.size(); ++e) {
    if (!is_ridge(labels[e])) continue;
    for (const Index v : {topology.edges[e].v0, topology.edges[e].v1}) {
      if (rings[v] == 0) continue;
      rings[v] = 0;
      queue.push_back(v);
    }
  }
  for (std::size_t i = 0; i < queue.size(); ++i) {
    const Index v = queue[i];
    for (const Index e : topology.vertex_edges[v]) {
      const Index other = other_end(topology.edges[e], v);
      if (rings[other] <= rings[v] + 1) continue;
      rings[other] = rings[v] + 1;
      queue.push_back(other);
    }
  }
  return rings;
}

double mean_or_one(const std::vector<double>& values) {
  const double sum = std::accumulate(values.begin(), values.end(), 0.0);
  return sum > 0 ? sum / static_cast<double>(values.size()) : 1;
}

}  // namespace

SegmentField::SegmentField(const Mesh& mesh, const Topology& topology, const std::vector<Vec3>& positions,
                           const std::vector<double>& labels, const std::vector<double>& dihedral_rad,
                           const SegmentOptions& options, ThreadTeam& team)
    : topology_(topology),
      labels_(labels),
      options_(options),
      border_cost_(topology.edges.size(), 0),
      area_(face_areas(mesh, positions, team)),
      neighbors_(mesh.triangles.size()),
      rings_(count_rings(topology, labels, options.gap_rings)) {
  const double mean_area = mean_or_one(area_);
  for (double& area : area_) area = std::max(area / mean_area, kLeastArea);
  const double surface = std::accumulate(area_.begin(), area_.end(), 0.0);
  small_area_ = std::min(options.small_area, options.small_fraction * surface);

  for_each(neighbors_.size(), team, [&](std::size_t f) {
    for (std::size_t k = 0; k < 3; ++k) {
      neighbors_[f][k] = topology.face_across(static_cast<Index>(f), topology.face_edges[f][k]);
    }
  });
  const double mean_length = mean_edge_length(positions, topology.edges);
  std::vector<double> inside(border_cost_.size(), 0);
  for_each(border_cost_.size(), team, [&](std::size_t e) {
    if (!topology.is_interior(e)) return;
    const auto [v0, v1] = topology.edges[e];
    const double length = mean_length > 0 ? (positions[v0] - positions[v1]).norm() / mean_length : 0;
    const double bend = dihedral_rad[e] / options.bend_scale;
    const double away = 1 + std::min(rings_[v0], rings_[v1]);
    inside[e] = options.ridge_weight * labels[e] * length;
    border_cost_[e] = (1 - labels[e]) * std::exp(-bend * bend) * away * length - inside[e];
  });
  unsegmented_ = std::accumulate(inside.begin(), inside.end(), 0.0);
}

double SegmentField::smallness(double segment_area) const {
  return segment_area < small_area_ ? options_.small_weight * (1 - segment_area / small_area_) : 0;
}

double SegmentField::energy(std::span<const Index> segments) const {
  double sum = unsegmented_;
  for (Index e = 0; e < border_cost_.size(); ++e) {
    const auto [f0, f1] = topology_.edge_faces[e];
    if (topology_.is_interior(e) && segments[f0] != segments[f1]) sum += border_cost_[e];
  }
  std::vector<double> areas(segments.empty() ? 0 : *std::ranges::max_element(segments) + std::size_t{1}, 0);
  for (Index f = 0; f < segments.size(); ++f) areas[segments[f]] += area_[f];
  for (const double area : areas) sum += area > 0 ? smallness(area) : 0;
  return sum;
}

namespace {

/// Merges and expands the given segments.
Segmentation minimise(const SegmentField& field, std::vector<Index> segments) {
  Segmentation result;
  result.segments = std::move(segments);
  result.energies.push_back(field.energy(result.segments));
  merge_segments(field, result.segments);
  result.energies.push_back(field.energy(result.segments));
  for (std::uint32_t sweep = 0; sweep < field.options().sweeps; ++sweep) {
    std::vector<Index> moved = result.segments;
    expand_segments(field, moved);
    split_segments(field, moved);
    merge_segments(field, moved);
    const double energy = field.energy(moved);
    if (energy > result.energies.back() - kNegligible) break;
    result.segments = std::move(moved);
    result.energies.push_back(energy);
  }
  result.count = split_segments(field, result.segments);
  return result;
}

}  // namespace

Segmentation segment_faces(const SegmentField& field, ThreadTeam& team) {
  Segmentation from_basins, from_faces;
  run_together(
      team, [&] { from_basins = minimise(field, seed_segments(field)); },
      [&] { from_faces = minimise(field, seed_faces(field)); });
  return std::move(from_faces.energies.back() < from_basins.energies.back() - kNegligible ? from_faces : from_basins);
}

Segmentation segment_faces(const Mesh& mesh, const Topology& topology, const std::vector<Vec3>& positions,
                           const std::vector<double>& labels, const SegmentOptions& options, ThreadTeam& team) {
  const std::vector<double> dihedral_rad = signed_dihedral_angles(mesh, topology, positions, team);
  return segment_faces(SegmentField(mesh, topology, positions, labels, dihedral_rad, options, team), team);
}

}  // namespace crease
