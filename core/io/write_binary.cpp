#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/io/write_formats.h"
#include "core/io/write_number.h"

namespace crease {

std::array<float, 3> to_single(const Vec3& position, std::size_t vertex) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  if (!(position.cwiseAbs().maxCoeff() <= kLargest)) {
    throw Error(code::kMeshUnsupported,
                fmt::format("vertex {} at ({}, {}, {}) does not fit into the single precision of this format", vertex,
                            position.x(), position.y(), position.z()),
                fmt::format("vertex {}", vertex));
  }
  return {static_cast<float>(position.x()), static_cast<float>(position.y()), static_cast<float>(position.z())};
}

std::string write_ply(const Mesh& mesh) {
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\n"
      "element vertex {}\nproperty double x\nproperty double y\nproperty double z\n"
      "element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
      mesh.positions.size(), mesh.triangles.size());
  bytes.reserve(bytes.size() + 24 * mesh.positions.size() + 13 * mesh.triangles.size());
  for (const Vec3& position : mesh.positions) {
    for (const double coordinate : position) append_little_endian(bytes, coordinate);
  }
  for (const Triangle& triangle : mesh.triangles) {
    append_little_endian(bytes, static_cast<std::uint8_t>(3));
    for (const Index corner : triangle) append_little_endian(bytes, corner);
  }
  return bytes;
}

std::string write_stl(const Mesh& mesh) {
  std::string bytes = "binary STL written by creased";
  bytes.resize(80, ' ');
  bytes.reserve(84 + 50 * mesh.triangles.size());
  append_little_endian(bytes, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const Triangle& triangle : mesh.triangles) {
    const auto& [a, b, c] = triangle;
    const Vec3 ab = mesh.positions[b] - mesh.positions[a], ac = mesh.positions[c] - mesh.positions[a];
    const Vec3 normal = ab.stableNormalized().cross(ac.stableNormalized()).stableNormalized();
    for (const double coordinate : normal) append_little_endian(bytes, static_cast<float>(coordinate));
    for (const Index corner : triangle) {
      for (const float coordinate : to_single(mesh.positions[corner], corner)) append_little_endian(bytes, coordinate);
    }
    append_little_endian(bytes, std::uint16_t{0});
  }
  return bytes;
}

}  // namespace crease
