#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include "core/mesh/mesh.h"

namespace crease::quality {

using Color = std::array<float, 3>;  // red, green, blue in [0, 1]

/// A line on the surface, in the coordinates of the mesh.
struct Line {
  Vec3 from, to;
  Color color{};
};

/// The view of a picture. The mesh is turned by these angles in degrees about x and then about y, and seen from the
/// front without perspective. `box` fills the frame, so that pictures of several meshes can be compared.
struct View {
  double turn_x = 0, turn_y = 0;
  std::vector<Vec3> box;
};

/// A mesh of a picture and the lines on it.
struct Panel {
  const Mesh& mesh;
  std::vector<Line> lines;
};

/// Draws meshes side by side in the same view, each as `render` does, into one PNG of `size` pixels height.
/// \throw std::runtime_error when the file cannot be written
void render_row(const std::vector<Panel>& panels, const View& view, int size, const std::filesystem::path& png);

/// Draws a mesh, with each face in a shade of grey that depends on its normal and with the visible parts of the lines.
/// Writes a PNG of `size` × `size` pixels.
/// \throw std::runtime_error when the file cannot be written
void render(const Mesh& mesh, const std::vector<Line>& lines, const View& view, int size,
            const std::filesystem::path& png);

}  // namespace crease::quality
