#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace crease {

using Vec3 = Eigen::Vector3d;
using Index = std::uint32_t;
using Triangle = std::array<Index, 3>;

inline constexpr Index kNone = 0xffffffffU;

/// An indexed triangle mesh in the order of the upload. The indices are in range; anything else is allowed, such as
/// non-manifold edges, duplicate and degenerate faces, and isolated vertices.
struct Mesh {
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;
};

/// A larger mesh takes seconds, and gets less work.
inline constexpr std::size_t kFacesOfSeconds = 250'000;

}  // namespace crease
