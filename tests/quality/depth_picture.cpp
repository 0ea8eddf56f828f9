#include "tests/quality/depth_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>

namespace crease::quality {
namespace {

/// White noise after a Gaussian of this width, with a deviation of 1.
Picture smooth_noise(Eigen::Index size, double width, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  Picture noise(size, size);
  for (double& value : noise.reshaped()) value = normal(random);
  if (!(width > 0)) return noise;
  const auto reach = static_cast<Eigen::Index>(std::ceil(4 * width));
  Eigen::MatrixXd filter = Eigen::MatrixXd::Zero(size, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = std::max<Eigen::Index>(0, i - reach); j <= std::min(size - 1, i + reach); ++j) {
      filter(i, j) = std::exp(-0.5 * std::pow(static_cast<double>(i - j) / width, 2));
    }
  }
  noise = (filter * noise.matrix() * filter).array();
  return noise / std::sqrt(noise.square().mean());
}

std::vector<Triangle> largest_part(const std::vector<Triangle>& faces, std::size_t corners) {
  std::vector<Index> parent(corners);
  std::iota(parent.begin(), parent.end(), Index{0});
  const auto root = [&](Index v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const Triangle& face : faces) {
    parent[root(face[1])] = root(face[0]);
    parent[root(face[2])] = root(face[0]);
  }
  std::map<Index, std::size_t> sizes;
  for (const Triangle& face : faces) ++sizes[root(face[0])];
  const auto largest = std::ranges::max_element(sizes, {}, [](const auto& part) { return part.second; });
  std::vector<Triangle> part;
  for (const Triangle& face : faces) {
    if (root(face[0]) == largest->first) part.push_back(face);
  }
  return part;
}

}  // namespace

Rays::Rays(double pixels_across, double distance)
    : focal_(pixels_across * distance), half_(static_cast<Eigen::Index>(pixels_across)) {}

Vec3 Rays::point(Eigen::Index row, Eigen::Index column, double depth) const {
  return {static_cast<double>(column - half_) * depth / focal_, static_cast<double>(row - half_) * depth / focal_,
          depth};
}

Eigen::Vector2d Rays::pixel_of(const Vec3& point) const {
  return point.head<2>() * (focal_ / point.z()) + Eigen::Vector2d::Constant(static_cast<double>(half_));
}

Picture Rays::depths_of(const Mesh& mesh) const {
  Picture depths = Picture::Constant(2 * half_ + 1, 2 * half_ + 1, kNothing);
  for (const Triangle& face : mesh.triangles) draw(mesh, face, depths);
  return depths;
}

/// One over the depth is linear in the picture.
void Rays::draw(const Mesh& mesh, const Triangle& face, Picture& depths) const {
  std::array<Eigen::Vector2d, 3> corner;
  Eigen::AlignedBox2d box;
  Vec3 inverse;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3& p = mesh.positions[face[k]];
    corner[k] = pixel_of(p);
    box.extend(corner[k]);
    inverse[static_cast<Eigen::Index>(k)] = 1 / p.z();
  }
  Eigen::Matrix2d edges;
  edges << corner[1] - corner[0], corner[2] - corner[0];
  if (std::abs(edges.determinant()) < 1e-12) return;
  const Eigen::Matrix2d to_shares = edges.inverse();
  const auto from = [](double x) { return std::max<Eigen::Index>(0, static_cast<Eigen::Index>(std::ceil(x))); };
  const auto to = [&](double x) {
    return std::min<Eigen::Index>(depths.rows() - 1, static_cast<Eigen::Index>(std::floor(x)));
  };
  for (Eigen::Index row = from(box.min().y()); row <= to(box.max().y()); ++row) {
    for (Eigen::Index column = from(box.min().x()); column <= to(box.max().x()); ++column) {
      const Eigen::Vector2d pixel(static_cast<double>(column), static_cast<double>(row));
      const Eigen::Vector2d shares = to_shares * (pixel - corner[0]);
      const double first = 1 - shares.sum();
      if (std::min(first, shares.minCoeff()) < -1e-9) continue;
      const double depth = 1 / (first * inverse[0] + shares[0] * inverse[1] + shares[1] * inverse[2]);
      depths(row, column) = std::min(depths(row, column), depth);
    }
  }
}

Picture with_depth_noise(const Picture& depths, const DepthNoise& noise, double pixel, double distance,
                         std::mt19937_64& random) {
  const Picture fine = smooth_noise(depths.rows(), noise.fine_width, random);
  const Picture broad = smooth_noise(depths.rows(), noise.broad_width, random);
  Picture noisy = depths;
  for (Eigen::Index row = 0; row + 1 < depths.rows(); ++row) {
    for (Eigen::Index column = 0; column + 1 < depths.cols(); ++column) {
      double& depth = noisy(row, column);
      if (depth == kNothing) continue;
      double slope =
          std::max(std::abs(depths(row + 1, column) - depth), std::abs(depths(row, column + 1) - depth)) / pixel;
      slope = std::min(slope, 3.0);
      const double level = noise.level * (1 + noise.growth_with_slope * slope) * pixel;
      depth += level * (std::sqrt(1 - noise.broad_share) * fine(row, column) +
                        std::sqrt(noise.broad_share) * broad(row, column));
      if (!(noise.step > 0)) continue;
      const double step = noise.step * pixel;
      if (noise.rounds_disparity) {
        const double disparity_step = step / (distance * distance);
        depth = 1 / (std::round(1 / depth / disparity_step) * disparity_step);
      } else {
        depth = std::round(depth / step) * step;
      }
    }
  }
  return noisy;
}

Eigen::Quaterniond random_turn(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  Eigen::Quaterniond turn(normal(random), normal(random), normal(random), normal(random));
  return turn.normalized();
}

std::optional<DepthView> view_of(const std::vector<Triangle>& faces, std::size_t corners,
                                 const std::function<Vec3(Index)>& original, const std::function<Vec3(Index)>& noisy) {
  constexpr std::size_t kFewestFaces = 1000;
  if (faces.size() < kFewestFaces) return std::nullopt;
  DepthView view;
  std::map<Index, Index> numbers;
  for (const Triangle& face : largest_part(faces, corners)) {
    Triangle& placed = view.original.triangles.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [known, is_new] = numbers.emplace(face[k], static_cast<Index>(numbers.size()));
      placed[k] = known->second;
      if (!is_new) continue;
      view.original.positions.push_back(original(face[k]));
      view.noisy.positions.push_back(noisy(face[k]));
    }
  }
  if (view.original.triangles.size() < kFewestFaces) return std::nullopt;
  view.noisy.triangles = view.original.triangles;
  return view;
}

DepthNoise random_depth_noise(std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  DepthNoise noise;
  noise.level = 0.12 * std::pow(10.0, unit(random));
  noise.fine_width = 0.5 + 1.5 * unit(random);
  noise.broad_width = 2 + 3 * unit(random);
  if (unit(random) < 0.5) noise.broad_share = 0.6 * unit(random);
  if (unit(random) < 0.5) noise.growth_with_slope = 0.3 * unit(random);
  if (unit(random) < 0.6) noise.step = noise.level * 0.2 * std::pow(12.0, unit(random));
  noise.rounds_disparity = unit(random) < 0.5;
  return noise;
}

}  // namespace crease::quality
