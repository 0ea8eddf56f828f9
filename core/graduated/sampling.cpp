#include "core/graduated/sampling.h"

#include <array>

namespace crease {
namespace {

constexpr int kSteps = 8;  ///< of conjugate gradients; more move hardly anything

/// Vectors of the vertices within the surface.
class TangentVectors {
 public:
  TangentVectors(const SamplingView& view, ThreadTeam& team)
      : mesh_(view.mesh), normals_(view.normals), team_(team), to_means_(3 * mesh_.vertex_count) {}

  /// `vector(v, axis)` of each vertex, less what points along its normal.
  template <typename Vector>
  void set(FlatVectors& vectors, Vector vector) const {
    const std::size_t count = mesh_.vertex_count;
    for_each(count, team_, [&](std::size_t v) {
      const auto normal = vector_at(normals_, v);
      std::array<float, 3> whole{};
      float along = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        whole[axis] = vector(v, axis);
        along += whole[axis] * normal[axis];
      }
      for (std::size_t axis = 0; axis < 3; ++axis) vectors[axis * count + v] = whole[axis] - along * normal[axis];
    });
  }

  double product(const FlatVectors& a, const FlatVectors& b) const {
    return block_sum<double>(a.size(), team_, [&](std::size_t i) { return static_cast<double>(a[i] * b[i]); });
  }

  /// Half the gradient of the squared ways within the surface from `x` to the means of neighbours. Vertices at borders
  /// have no such way.
  void gradient(std::span<const float> x, FlatVectors& result) {
    const std::size_t count = mesh_.vertex_count;
    set(to_means_, [&](std::size_t v, std::size_t axis) {
      float sum = 0;
      for (const Index other : mesh_.vertex_neighbors[v]) sum += x[axis * count + other] - x[axis * count + v];
      return sum * share(v);
    });
    set(result, [&](std::size_t v, std::size_t axis) {
      float sum = share(v) > 0 ? -to_means_[axis * count + v] : 0;
      for (const Index other : mesh_.vertex_neighbors[v]) sum += to_means_[axis * count + other] * share(other);
      return sum;
    });
  }

 private:
  /// Of a neighbour in the mean.
  float share(std::size_t v) const {
    const std::size_t neighbors = mesh_.vertex_neighbors[v].size();
    return mesh_.at_border[v] != 0 || neighbors == 0 ? 0 : 1 / static_cast<float>(neighbors);
  }

  const FlatMesh& mesh_;
  std::span<const float> normals_;
  ThreadTeam& team_;
  FlatVectors to_means_;
};

}  // namespace

FlatVectors evening_moves(const SamplingView& view, float ratio, ThreadTeam& team) {
  const std::size_t count = view.mesh.vertex_count, size = 3 * count;
  TangentVectors tangent(view, team);
  FlatVectors moves(size, 0), rest(size), direction, response(size);
  tangent.gradient(view.positions, response);
  tangent.set(rest, [&](std::size_t v, std::size_t axis) {
    const std::size_t i = axis * count + v;
    return view.measured[i] - view.positions[i] - ratio * response[i];
  });
  direction = rest;
  double squares = tangent.product(rest, rest);
  for (int step = 0; step < kSteps && squares > 0; ++step) {
    tangent.gradient(direction, response);
    for_each(size, team, [&](std::size_t i) { response[i] = direction[i] + ratio * response[i]; });
    const auto length = static_cast<float>(squares / tangent.product(direction, response));
    for_each(size, team, [&](std::size_t i) {
      moves[i] += length * direction[i];
      rest[i] -= length * response[i];
    });
    const double left = tangent.product(rest, rest);
    const auto kept = static_cast<float>(left / squares);
    for_each(size, team, [&](std::size_t i) { direction[i] = rest[i] + kept * direction[i]; });
    squares = left;
  }
  return moves;
}

}  // namespace crease
