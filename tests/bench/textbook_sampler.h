#pragma once

#include <random>
#include <vector>

#include "core/mesh/openmesh.h"

namespace crease::bench {

/// The vertex process of §3.5 as a textbook would write it with OpenMesh: one vertex after the other, circulators for
/// the neighbourhood, OpenMesh's stored face normals, the quadratic potential, no labels. The baseline for the packed
/// sampler.
class TextbookSampler {
 public:
  TextbookSampler(HalfEdgeMesh mesh, double likelihood_weight);

  /// Runs one Metropolis pass over all vertices. Returns the number of accepted proposals.
  std::size_t sweep(double temperature, double step);
  std::size_t vertices() const { return mesh_.n_vertices(); }

 private:
  double local_energy(HalfEdgeMesh::VertexHandle vertex) const;
  void move(HalfEdgeMesh::VertexHandle vertex, const HalfEdgeMesh::Point& position);

  HalfEdgeMesh mesh_;
  std::vector<HalfEdgeMesh::Point> measured_;
  double likelihood_weight_;
  std::mt19937 random_{1};
};

}  // namespace crease::bench
