#include "tests/quality/yardsticks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/mesh/face_vectors.h"

namespace crease::quality {
namespace {

/// What the filters need to know of the faces at some positions.
struct FaceGeometry {
  FaceGeometry(const Mesh& mesh, const Topology& topology, const std::vector<Vec3>& positions) {
    const std::size_t count = mesh.triangles.size();
    areas.reserve(count);
    centroids.reserve(count);
    for (std::size_t face = 0; face < count; ++face) {
      areas.push_back(area_vector(positions, mesh.triangles[face]).norm() / 2);
      centroids.push_back(centroid(positions, mesh.triangles[face]));
    }
    normals = face_normals(mesh, topology, positions);
  }

  std::vector<double> areas;
  std::vector<Vec3> centroids, normals;
};

double mean_centroid_distance(const Topology& topology, const std::vector<Vec3>& centroids) {
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t edge = 0; edge < topology.edges.size(); ++edge) {
    if (!topology.is_interior(edge)) continue;
    const auto [first, second] = topology.edge_faces[edge];
    sum += (centroids[first] - centroids[second]).norm();
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : 0;
}

/// Collects sets of faces, or of edges, each member once.
class Collector {
 public:
  explicit Collector(std::size_t count) : seen_(count, 0) {}

  void clear() {
    ++round_;
    items_.clear();
  }
  /// Whether the member is new.
  bool add(Index member) {
    if (contains(member)) return false;
    seen_[member] = round_;
    items_.push_back(member);
    return true;
  }
  bool contains(Index member) const { return seen_[member] == round_; }
  const std::vector<Index>& items() const { return items_; }

 private:
  std::vector<std::uint32_t> seen_;
  std::vector<Index> items_;
  std::uint32_t round_ = 1;
};

void add_row(const std::vector<Index>& row, IndexRows& rows) {
  rows.items.insert(rows.items.end(), row.begin(), row.end());
  rows.starts.push_back(static_cast<Index>(rows.items.size()));
}

/// Each face, followed by the faces that share a vertex with it.
IndexRows faces_round_faces(const Mesh& mesh, const Topology& topology) {
  IndexRows rows;
  Collector found(mesh.triangles.size());
  for (std::size_t face = 0; face < mesh.triangles.size(); ++face) {
    found.clear();
    found.add(static_cast<Index>(face));
    for (const Index vertex : mesh.triangles[face]) {
      for (const Index other : topology.vertex_faces[vertex]) found.add(other);
    }
    add_row(found.items(), rows);
  }
  return rows;
}

/// Per face the connected faces with a centroid closer than `radius`, itself included.
IndexRows faces_within(const IndexRows& rings, const std::vector<Vec3>& centroids, double radius) {
  IndexRows rows;
  Collector seen(centroids.size());
  std::vector<Index> near;
  for (std::size_t face = 0; face < centroids.size(); ++face) {
    seen.clear();
    seen.add(static_cast<Index>(face));
    near.assign(1, static_cast<Index>(face));
    for (std::size_t next = 0; next < near.size(); ++next) {
      for (const Index other : rings[near[next]]) {
        if (seen.add(other) && (centroids[other] - centroids[face]).norm() < radius) near.push_back(other);
      }
    }
    add_row(near, rows);
  }
  return rows;
}

/// Area times the spatial Gaussian, for every item of `neighbors`. The area is of the neighbour.
std::vector<double> spatial_weights(const IndexRows& neighbors, const FaceGeometry& faces, double width) {
  std::vector<double> weights;
  weights.reserve(neighbors.items.size());
  const double factor = width > 0 ? -1 / (2 * width * width) : 0;
  for (std::size_t face = 0; face < neighbors.size(); ++face) {
    for (const Index other : neighbors[face]) {
      const double square = (faces.centroids[face] - faces.centroids[other]).squaredNorm();
      weights.push_back(faces.areas[other] * std::exp(factor * square));
    }
  }
  return weights;
}

/// One pass of a joint bilateral filter: `normals` are averaged, and `guides` are compared.
void filter_normals(const IndexRows& neighbors, const std::vector<double>& weights, const std::vector<Vec3>& guides,
                    double range_width, const std::vector<Vec3>& normals, std::vector<Vec3>& filtered) {
  const double factor = -1 / (2 * range_width * range_width);
  filtered.resize(normals.size());
  for (std::size_t face = 0; face < normals.size(); ++face) {
    const Vec3 guide = guides[face];
    Vec3 sum = Vec3::Zero();
    for (Index k = neighbors.starts[face]; k < neighbors.starts[face + 1]; ++k) {
      const Index other = neighbors.items[k];
      sum += weights[k] * std::exp(factor * (guides[other] - guide).squaredNorm()) * normals[other];
    }
    const double length = sum.norm();
    filtered[face] = length > 0 ? Vec3(sum / length) : normals[face];
  }
}

/// The patches of guided normal filtering. Which faces and inner edges they have never changes.
class GuidancePatches {
 public:
  GuidancePatches(const IndexRows& rings, const Topology& topology) : patches_(rings) {
    Collector patch(rings.size()), edges(topology.edges.size());
    for (std::size_t face = 0; face < rings.size(); ++face) {
      patch.clear();
      edges.clear();
      for (const Index member : rings[face]) patch.add(member);
      for (const Index member : rings[face]) {
        for (const Index edge : topology.face_edges[member]) {
          const Index other = topology.face_across(member, edge);
          if (other != kNone && patch.contains(other)) edges.add(edge);
        }
      }
      add_row(edges.items(), inner_edges_);
    }
  }

  /// Per face the unit mean normal of the most consistent patch that it is in.
  std::vector<Vec3> guidances(const Topology& topology, const FaceGeometry& faces) {
    measure_edges(topology, faces.normals);
    scores_.resize(patches_.size());
    means_.resize(patches_.size());
    for (std::size_t patch = 0; patch < patches_.size(); ++patch) {
      scores_[patch] = normal_range(patch, faces.normals) * relative_saliency(patch);
      Vec3 sum = Vec3::Zero();
      for (const Index face : patches_[patch]) sum += faces.areas[face] * faces.normals[face];
      means_[patch] = direction(sum);
    }
    std::vector<Vec3> result(patches_.size());
    for (std::size_t face = 0; face < result.size(); ++face) {
      const auto candidates = patches_[face];
      const Index best =
          *std::ranges::min_element(candidates, [&](Index a, Index b) { return scores_[a] < scores_[b]; });
      result[face] = means_[best];
    }
    return result;
  }

 private:
  void measure_edges(const Topology& topology, const std::vector<Vec3>& normals) {
    differences_.assign(topology.edges.size(), 0);
    for (std::size_t edge = 0; edge < topology.edges.size(); ++edge) {
      if (!topology.is_interior(edge)) continue;
      const auto [first, second] = topology.edge_faces[edge];
      differences_[edge] = (normals[first] - normals[second]).norm();
    }
  }

  /// Φ: the largest difference of two normals of the patch.
  double normal_range(std::size_t patch, const std::vector<Vec3>& normals) const {
    const auto members = patches_[patch];
    double largest = 0;
    for (std::size_t i = 0; i < members.size(); ++i) {
      for (std::size_t j = i + 1; j < members.size(); ++j) {
        largest = std::max(largest, (normals[members[i]] - normals[members[j]]).squaredNorm());
      }
    }
    return std::sqrt(largest);
  }

  /// R: the share that the most salient inner edge has of the saliency of all.
  double relative_saliency(std::size_t patch) const {
    constexpr double kTiny = 1e-9;
    double largest = 0, sum = 0;
    for (const Index edge : inner_edges_[patch]) {
      largest = std::max(largest, differences_[edge]);
      sum += differences_[edge];
    }
    return largest / (kTiny + sum);
  }

  const IndexRows& patches_;
  IndexRows inner_edges_;
  std::vector<double> differences_, scores_;
  std::vector<Vec3> means_;
};

}  // namespace

void update_vertices(const Mesh& mesh, const Topology& topology, const std::vector<Vec3>& normals, int iterations,
                     std::vector<Vec3>& positions) {
  std::vector<Vec3> centroids(mesh.triangles.size());
  for (int iteration = 0; iteration < iterations; ++iteration) {
    for (std::size_t face = 0; face < centroids.size(); ++face) {
      centroids[face] = centroid(positions, mesh.triangles[face]);
    }
    for (std::size_t vertex = 0; vertex < positions.size(); ++vertex) {
      const auto faces = topology.vertex_faces[vertex];
      if (faces.empty()) continue;
      Vec3 step = Vec3::Zero();
      for (const Index face : faces) step += normals[face].dot(centroids[face] - positions[vertex]) * normals[face];
      positions[vertex] += step / static_cast<double>(faces.size());
    }
  }
}

std::vector<Vec3> filter_bilateral_normals(const Mesh& noisy, const Topology& topology,
                                           const BilateralNormalOptions& options) {
  const FaceGeometry faces(noisy, topology, noisy.positions);
  const IndexRows neighbors = faces_round_faces(noisy, topology);
  const std::vector<double> weights =
      spatial_weights(neighbors, faces, mean_centroid_distance(topology, faces.centroids));
  std::vector<Vec3> normals = faces.normals, filtered;
  for (int iteration = 0; iteration < options.normal_iterations; ++iteration) {
    filter_normals(neighbors, weights, normals, options.range_width, normals, filtered);
    normals.swap(filtered);
  }
  std::vector<Vec3> positions = noisy.positions;
  update_vertices(noisy, topology, normals, options.vertex_iterations, positions);
  return positions;
}

std::vector<Vec3> filter_guided_normals(
    const Mesh& noisy, const Topology& topology, const GuidedNormalOptions& options,
    const std::function<void(int iteration, const std::vector<Vec3>&)>& after_iteration) {
  const IndexRows rings = faces_round_faces(noisy, topology);
  GuidancePatches patches(rings, topology);
  std::vector<Vec3> positions = noisy.positions, filtered;
  IndexRows neighbors;
  for (int iteration = 1; iteration <= options.iterations; ++iteration) {
    const FaceGeometry faces(noisy, topology, positions);
    const double distance = mean_centroid_distance(topology, faces.centroids);
    if (iteration == 1) neighbors = faces_within(rings, faces.centroids, options.radius * distance);
    const std::vector<double> weights = spatial_weights(neighbors, faces, distance);
    filter_normals(neighbors, weights, patches.guidances(topology, faces), options.range_width, faces.normals,
                   filtered);
    update_vertices(noisy, topology, filtered, options.vertex_iterations, positions);
    if (after_iteration) after_iteration(iteration, positions);
  }
  return positions;
}

}  // namespace crease::quality
