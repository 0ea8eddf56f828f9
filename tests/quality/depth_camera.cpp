#include "tests/quality/depth_camera.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

namespace crease::quality {
namespace {

/// The model turned at random, with 1 as its larger side in the picture, `distance` in front of the camera.
Mesh placed(const Mesh& model, double distance, std::mt19937_64& random) {
  const Eigen::Quaterniond turn = random_turn(random);
  Mesh mesh = model;
  Eigen::AlignedBox3d box;
  for (Vec3& position : mesh.positions) {
    position = turn * position;
    box.extend(position);
  }
  const double size = std::max(box.sizes()[0], box.sizes()[1]);
  for (Vec3& position : mesh.positions) position = (position - box.center()) / size + Vec3(0, 0, distance);
  return mesh;
}

/// Faces between neighbouring pixels, each pair along the shorter diagonal. Corners are numbers of pixels.
std::vector<Triangle> faces_between(const Picture& depths, double farthest_step) {
  std::vector<Triangle> faces;
  const auto number = [&](Eigen::Index row, Eigen::Index column) {
    return static_cast<Index>(row * depths.cols() + column);
  };
  const auto depth = [&](Index pixel) {
    return depths(static_cast<Eigen::Index>(pixel) / depths.cols(), static_cast<Eigen::Index>(pixel) % depths.cols());
  };
  const auto add = [&](Index a, Index b, Index c) {
    const auto [low, high] = std::minmax({depth(a), depth(b), depth(c)});
    if (high != kNothing && high - low < farthest_step) faces.push_back({a, b, c});
  };
  for (Eigen::Index row = 0; row + 1 < depths.rows(); ++row) {
    for (Eigen::Index column = 0; column + 1 < depths.cols(); ++column) {
      const Index a = number(row, column), b = number(row, column + 1), c = number(row + 1, column + 1),
                  d = number(row + 1, column);
      const double one = std::abs(depth(a) - depth(c)), other = std::abs(depth(b) - depth(d));
      if (std::isnan(other) || other == kNothing || one <= other) {
        add(a, c, b);
        add(a, d, c);
      } else {
        add(a, d, b);
        add(b, d, c);
      }
    }
  }
  return faces;
}

}  // namespace

std::optional<DepthView> take_depth_view(const Mesh& model, const DepthCamera& camera, const DepthNoise& noise,
                                         std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const Rays rays(camera.pixels_across, camera.distance);
  const Picture depths = rays.depths_of(placed(model, camera.distance, random));
  const double pixel = 1 / camera.pixels_across;
  const Picture noisy = with_depth_noise(depths, noise, pixel, camera.distance, random);
  const auto point = [&](const Picture& picture, Index number) {
    const auto row = static_cast<Eigen::Index>(number) / depths.cols(),
               column = static_cast<Eigen::Index>(number) % depths.cols();
    return rays.point(row, column, picture(row, column));
  };
  return view_of(
      faces_between(depths, camera.farthest_step * pixel), static_cast<std::size_t>(depths.size()),
      [&](Index number) { return point(depths, number); }, [&](Index number) { return point(noisy, number); });
}

DepthCamera random_camera(std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  DepthCamera camera;
  camera.pixels_across = 55 + 60 * unit(random);
  camera.distance = 2.5 * std::pow(4.0, unit(random));
  camera.farthest_step = 4 + 5 * unit(random);
  return camera;
}

}  // namespace crease::quality
