#include "tests/bench/textbook_sampler.h"

#include <cmath>
#include <utility>

namespace crease::bench {

TextbookSampler::TextbookSampler(HalfEdgeMesh mesh, double likelihood_weight)
    : mesh_(std::move(mesh)), likelihood_weight_(likelihood_weight) {
  mesh_.request_face_normals();
  mesh_.update_face_normals();
  for (const auto vertex : mesh_.vertices()) measured_.push_back(mesh_.point(vertex));
}

double TextbookSampler::local_energy(HalfEdgeMesh::VertexHandle vertex) const {
  double sum = likelihood_weight_ * (mesh_.point(vertex) - measured_[static_cast<std::size_t>(vertex.idx())]).sqrnorm();
  const auto add = [&](HalfEdgeMesh::HalfedgeHandle half_edge) {
    const auto face = mesh_.face_handle(half_edge);
    const auto other = mesh_.opposite_face_handle(half_edge);
    if (face.is_valid() && other.is_valid()) sum += (mesh_.normal(face) - mesh_.normal(other)).sqrnorm();
  };
  for (auto half_edge = mesh_.cvoh_iter(vertex); half_edge.is_valid(); ++half_edge) {
    add(*half_edge);
    if (!mesh_.is_boundary(*half_edge)) add(mesh_.next_halfedge_handle(*half_edge));
  }
  return sum;
}

void TextbookSampler::move(HalfEdgeMesh::VertexHandle vertex, const HalfEdgeMesh::Point& position) {
  mesh_.set_point(vertex, position);
  for (auto face = mesh_.vf_iter(vertex); face.is_valid(); ++face) mesh_.update_normal(*face);
}

std::size_t TextbookSampler::sweep(double temperature, double step) {
  std::uniform_real_distribution<double> either_side(-step, step), unit(0, 1);
  std::size_t accepted = 0;
  for (const auto vertex : mesh_.vertices()) {
    const HalfEdgeMesh::Point old = mesh_.point(vertex);
    const double before = local_energy(vertex);
    move(vertex, old + HalfEdgeMesh::Point(either_side(random_), either_side(random_), either_side(random_)));
    const double delta = local_energy(vertex) - before;
    if (delta <= 0 || unit(random_) < std::exp(-delta / temperature)) {
      ++accepted;
    } else {
      move(vertex, old);
    }
  }
  return accepted;
}

}  // namespace crease::bench
