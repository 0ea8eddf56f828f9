#pragma once

#include <functional>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

/// Two well-known filters of face normals, written from their papers, to compare with.
namespace crease::quality {

/// Bilateral normal filtering, the local and iterative scheme [Zheng, Fu, Au & Tai 2011]. Each iteration replaces a
/// face normal by the mean of its neighbours' normals, weighted by area, by a Gaussian of the distance of centroids,
/// whose width is the mean distance of adjacent centroids, and by a Gaussian of the difference of normals. Neighbours
/// share a vertex. The vertices follow once, after the last iteration.
struct BilateralNormalOptions {
  double range_width = 0.35;   ///< σ_s, of the difference of unit normals
  int normal_iterations = 20;  ///< 1 or more
  int vertex_iterations = 10;  ///< of the vertex update
};

/// Positions in the units of `noisy`. One thread.
std::vector<Vec3> filter_bilateral_normals(const Mesh& noisy, const Topology& topology,
                                           const BilateralNormalOptions& options);

/// Guided normal filtering [Zhang, Deng, Zhang, Bouaziz & Liu 2015]. A patch is a face and the faces that share a
/// vertex with it. Its consistency is the largest difference of two of its normals times the relative saliency of its
/// edges; the mean normal of the most consistent patch round a face is the guidance of this face. A joint bilateral
/// filter then compares guidances in place of normals. Each iteration ends with a vertex update.
struct GuidedNormalOptions {
  double range_width = 0.35;   ///< σ_r, of the difference of guidances
  double radius = 2;           ///< r, of the geometric neighbourhood, in mean distances of adjacent centroids
  int iterations = 20;         ///< 1 or more
  int vertex_iterations = 10;  ///< of each vertex update
};

/// Positions in the units of `noisy`. One thread. `after_iteration`, if any, sees the positions of every iteration.
std::vector<Vec3> filter_guided_normals(
    const Mesh& noisy, const Topology& topology, const GuidedNormalOptions& options,
    const std::function<void(int iteration, const std::vector<Vec3>&)>& after_iteration = {});

/// Moves the vertices so that the faces turn to `normals`: a step takes each vertex to the mean of its projections onto
/// the planes through the centroids of its faces [Sun, Rosin, Martin & Langbein 2007, eq. 10]. All vertices move at
/// once.
void update_vertices(const Mesh& mesh, const Topology& topology, const std::vector<Vec3>& normals, int iterations,
                     std::vector<Vec3>& positions);

}  // namespace crease::quality
