#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include "core/mesh/mesh.h"

namespace crease::quality {

using Color = std::array<float, 3>;  // red, green, blue in [0, 1]

/// A line over the surface, in the coordinates of the mesh.
struct Line {
  Vec3 from, to;
  Color color{};
};

/// Where a picture is taken from: the mesh is turned by these angles in degrees about x and then about y, and seen from
/// the front without perspective, filling the frame. `box` is what fills it, so that several meshes can be compared.
struct View {
  double turn_x = 0, turn_y = 0;
  std::vector<Vec3> box;
};

/// A picture of a mesh, every face in one shade of grey by its normal, with lines drawn over it where they are not
/// hidden. Writes a PNG of `size` pixels square.
/// \throw std::runtime_error where the file cannot be written
void render(const Mesh& mesh, const std::vector<Line>& lines, const View& view, int size,
            const std::filesystem::path& png);

}  // namespace crease::quality
