#pragma once

#include "tests/support/meshes.h"

/// Parametric parts, whose ridges are known exactly: they are where two smooth surfaces meet at an angle. Vertices lie
/// on the surfaces.
namespace crease::quality {

/// How a part is sampled.
struct Sampling {
  double cells = 8;    ///< lattice cells per unit of length
  double jitter = 0;   ///< by which points inside of a surface leave the lattice, in cells, up to 0.4
  double grading = 1;  ///< the last cell of a stretch of the profile relative to the first
  double aspect = 1;   ///< length of a cell across the profile relative to along it
  bool closed = true;  ///< without its ends otherwise
};

inline constexpr Sampling kRegular{};
inline constexpr Sampling kIrregular{.jitter = 0.3};
inline constexpr Sampling kGraded{.cells = 10, .grading = 6};
inline constexpr Sampling kSlivers{.cells = 16, .aspect = 6};
inline constexpr Sampling kOpen{.closed = false};

using test::CadPart;

CadPart cut_box(const Sampling& sampling);  ///< a block with a cylindrical cut through its top
CadPart bracket(const Sampling& sampling);  ///< two plates at a right angle, joined by a fillet that is no ridge
CadPart channel(const Sampling& sampling);  ///< a block with a trapezoidal groove
CadPart shaft(const Sampling& sampling);    ///< three cylinders of different radii on one axis
CadPart spindle(const Sampling& sampling);  ///< a cylinder, a cone and a neck on one axis
CadPart cone(const Sampling& sampling);     ///< a right circular cone with its apex
CadPart bullet(const Sampling& sampling);   ///< a cylinder with a parabolic nose
CadPart elbow(const Sampling& sampling);    ///< a box and a quarter of a torus that grows out of its top

/// A prism over a regular polygon, its lateral edges no ridges: 16 sides make facets of 22.5°.
CadPart prism(int sides, int columns_per_side, int rows);

}  // namespace crease::quality
