#pragma once

#include <cmath>
#include <string_view>
#include <vector>

#include "core/energy/term.h"
#include "core/energy/vertex_move.h"
#include "core/geometry/lanes.h"

namespace crease {

/// ρ and dρ/d‖x‖². The slope is also the weight of the quadratic function that is tangent to ρ at x.
template <typename Number>
struct Potential {
  Number value, slope;
};

/// ρ(x) as a function of ‖x‖² (§3.2), where x is a difference of unit normals. Huber's and the truncated potential are
/// quadratic up to ‖x‖ = `width`. Number is float, double or Lanes. The slope of the square root at 0 is infinite.
template <Smoothness kShape, typename Number>
CREASE_LANES_INLINE Potential<Number> potential(const Number& square, float width) {
  using crease::sqrt;
  using std::sqrt;
  const Number one = Number{} + 1;
  if constexpr (kShape == Smoothness::kQuadratic) {
    return {square, one};
  } else if constexpr (kShape == Smoothness::kSquareRoot) {
    const Number root = sqrt(square);
    return {root, 1 / (2 * root)};
  } else if constexpr (kShape == Smoothness::kHuber) {
    const Number root = sqrt(square);
    return {square < width * width ? square : 2 * width * root - width * width,
            square < width * width ? one : width / root};
  } else {
    static_assert(kShape == Smoothness::kTruncated);
    return {square < width * width ? square : width * width + Number{}, square < width * width ? one : Number{}};
  }
}

/// Calls `body` with the shape as a template argument.
template <typename Body>
CREASE_LANES_INLINE auto with_shape(Smoothness shape, Body body) {
  switch (shape) {
    case Smoothness::kQuadratic:
      return body.template operator()<Smoothness::kQuadratic>();
    case Smoothness::kSquareRoot:
      return body.template operator()<Smoothness::kSquareRoot>();
    case Smoothness::kHuber:
      return body.template operator()<Smoothness::kHuber>();
    case Smoothness::kTruncated:
      return body.template operator()<Smoothness::kTruncated>();
  }
  __builtin_unreachable();
}

template <typename Number>
CREASE_LANES_INLINE Potential<Number> potential(Smoothness shape, Number square, float width) {
  return with_shape(shape,
                    [&]<Smoothness kShape>() [[gnu::always_inline]] { return potential<kShape>(square, width); });
}

/// Σ_e (1 − ε_e) ρ(n_i − n_j) over the interior edges: the prior that neighbouring faces have similar normals (§3.2),
/// except across ridges (§3.3).
class SmoothnessTerm {
 public:
  static constexpr std::string_view kName = "smoothness";
  static constexpr int kField = 2;
  static double weight(const MrfOptions& options) { return options.smoothness_weight; }
  explicit SmoothnessTerm(const TermSetup& setup);

  double energy(const Field& field, ThreadTeam& team) const;
  void labels_changed(const Field& field, ThreadTeam& team);
  double slope(const Field& field, Index edge) const { return -rho(field.edges.chord[edge]).value; }
  CREASE_LANES_INLINE double change(const Field& field, const VertexMove& move) const;

  /// Half a degree as a difference of normals. Below it, descent replaces the cone of the square-root potential by a
  /// smooth bowl, so that it has a derivative everywhere.
  static constexpr float kRounding = 0.01F;
  template <typename Real>
  CREASE_LANES_INLINE Potential<Real> at(Index edge, Real chord) const {
    const Real rounding = shape_ == Smoothness::kSquareRoot ? static_cast<Real>(kRounding * kRounding) : 0;
    const auto kept = static_cast<Real>(kept_[edge]);
    const Potential<Real> rho = potential(shape_, chord + rounding, width_);
    return {kept * rho.value, kept * rho.slope};
  }

  template <typename Real>
  Potential<Real> rho(Real chord) const {
    return potential(shape_, chord, width_);
  }
  /// 1 − ε per edge, 0 if it is not interior; then one more 0.
  const std::vector<float>& kept() const { return kept_; }

 private:
  template <Smoothness kShape>
  CREASE_LANES_INLINE double change_of(const Field& field, const VertexMove& move) const;

  Smoothness shape_;
  float width_;  ///< δ, as a difference of unit normals
  std::vector<float> kept_;
};

CREASE_LANES_INLINE double SmoothnessTerm::change(const Field& field, const VertexMove& move) const {
  return with_shape(shape_, [&]<Smoothness kShape>() [[gnu::always_inline]] { return change_of<kShape>(field, move); });
}

template <Smoothness kShape>
CREASE_LANES_INLINE double SmoothnessTerm::change_of(const Field& field, const VertexMove& move) const {
  const auto rho = [&](const LaneVectors& difference)
                       [[gnu::always_inline]] { return potential<kShape>(difference.squared_norm(), width_).value; };
  const auto weights = [&](const std::array<Index, Rings::kLanes>& edges) {
    Lanes result;
    for (std::size_t k = 0; k < Rings::kLanes; ++k) result[k] = kept_[edges[k]];
    return result;
  };
  const auto stored_normals = [&](const std::array<Index, Rings::kLanes>& faces) {
    return transposed([&](std::size_t k) { return load(field.normals[faces[k]].data()); });
  };
  Lanes change{};
  const LaneVectors* moved_block = move.normals();
  for (const Rings::Block& block : move.ring()) {
    const LaneVectors moved{moved_block->x, moved_block->y, moved_block->z};
    const LaneVectors normals = stored_normals(block.faces), outer = stored_normals(block.outer_faces);
    change += weights(block.rim_edges) * (rho(moved - outer) - rho(normals - outer)) +
              weights(block.spoke_edges) * (rho(moved - shifted_up(moved)) - rho(normals - shifted_up(normals)));
    ++moved_block;
  }
  return static_cast<double>(sum(change));
}

}  // namespace crease
