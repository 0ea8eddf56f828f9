#include "tests/quality/fused_scan.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <unordered_map>
#include <vector>

namespace crease::quality {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// The model with a largest side of 1 around the origin.
Mesh unit_sized(const Mesh& model) {
  Eigen::AlignedBox3d box;
  for (const Vec3& position : model.positions) box.extend(position);
  Mesh mesh = model;
  for (Vec3& position : mesh.positions) position = (position - box.center()) / box.sizes().maxCoeff();
  return mesh;
}

/// A number for each corner of a grid of cubes around the origin.
class Grid {
 public:
  Grid(double side, double voxel)
      : voxel_(voxel),
        count_(static_cast<Index>(std::ceil(side / voxel))),
        values_(std::size_t{count_} * count_ * count_) {}

  Index count() const { return count_; }
  std::size_t number(Index x, Index y, Index z) const { return (std::size_t{z} * count_ + y) * count_ + x; }
  Vec3 place(Index x, Index y, Index z) const { return voxel_ * (Vec3(x, y, z) - Vec3::Constant(0.5 * (count_ - 1))); }
  std::vector<double>& values() { return values_; }
  const std::vector<double>& values() const { return values_; }

  template <typename Visit>
  void visit(Index end, Visit visit) const {
    for (Index z = 0; z < end; ++z) {
      for (Index y = 0; y < end; ++y) {
        for (Index x = 0; x < end; ++x) visit(x, y, z);
      }
    }
  }

 private:
  double voxel_;
  Index count_;
  std::vector<double> values_;
};

/// Nothing where depths jump to those beside, as at the rims of what a camera sees.
Picture without_rims(const Picture& depths, double farthest_step) {
  Picture inner = depths;
  const Eigen::Index last = depths.rows() - 1;
  for (Eigen::Index row = 0; row <= last; ++row) {
    for (Eigen::Index column = 0; column <= last; ++column) {
      const auto jumps = [&](Eigen::Index other_row, Eigen::Index other_column) {
        const double other =
            depths(std::clamp<Eigen::Index>(other_row, 0, last), std::clamp<Eigen::Index>(other_column, 0, last));
        return !(std::abs(other - depths(row, column)) < farthest_step);
      };
      if (jumps(row - 1, column) || jumps(row + 1, column) || jumps(row, column - 1) || jumps(row, column + 1)) {
        inner(row, column) = kNothing;
      }
    }
  }
  return inner;
}

/// The mean of the signed distances that the views measure, cut off at the reach; unknown where none does. Negative
/// behind the surface.
Grid fused_distances(const Mesh& model, const FusedScan& scan, std::mt19937_64& random) {
  const double voxel = 1 / scan.voxels_across, pixel = 1 / scan.pixels_across, reach = scan.reach * voxel;
  Grid grid(std::sqrt(3.0) + 4 * voxel, voxel);
  std::vector<double>& sums = grid.values();
  std::vector<double> counts(sums.size(), 0);
  const Rays rays(scan.pixels_across, scan.distance);
  const Eigen::Quaterniond first = random_turn(random);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> unit(0, 1);
  for (int view = 0; view < scan.views; ++view) {
    const Vec3 axis = Vec3(normal(random), normal(random), normal(random)).normalized();
    const Eigen::Quaterniond turn = Eigen::AngleAxisd(scan.spread * unit(random), axis) * first;
    const Vec3 from_camera(0, 0, scan.distance);
    Mesh seen = model;
    for (Vec3& position : seen.positions) position = turn * position + from_camera;
    const Picture clean = without_rims(rays.depths_of(seen), scan.farthest_step * pixel);
    const Picture depths = with_depth_noise(clean, scan.noise, pixel, scan.distance, random);
    const Vec3 shift = scan.misplacement * voxel * Vec3(normal(random), normal(random), normal(random));
    grid.visit(grid.count(), [&](Index x, Index y, Index z) {
      const Vec3 place = turn * grid.place(x, y, z) + from_camera + shift;
      const Eigen::Vector2d spot = rays.pixel_of(place);
      const Eigen::Index column = std::lround(spot.x()), row = std::lround(spot.y());
      if (std::min(row, column) < 0 || std::max(row, column) >= depths.rows()) return;
      const double distance = depths(row, column) - place.z();
      if (distance < -reach || depths(row, column) == kNothing) return;
      sums[grid.number(x, y, z)] += std::min(1.0, distance / reach);
      ++counts[grid.number(x, y, z)];
    });
  }
  for (std::size_t i = 0; i < sums.size(); ++i) sums[i] = counts[i] > 0 ? sums[i] / counts[i] : kUnknown;
  return grid;
}

/// Corners of the six sides of a cube, counterclockwise from outside; bit k of a corner is its step along axis k.
constexpr std::array<std::array<unsigned, 4>, 6> kSides{
    {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}};

/// Marching cubes [Lorensen & Cline 1987]. On each side of a cube the zeros are joined around the corners that are
/// behind the surface, so that the cubes on both sides of it agree.
class MarchingCubes {
 public:
  explicit MarchingCubes(const Grid& grid) : grid_(grid) {
    grid.visit(grid.count() - 1, [&](Index x, Index y, Index z) { mesh_cube({x, y, z}); });
  }
  Mesh take() { return std::move(mesh_); }

 private:
  using Corner = std::array<Index, 3>;

  void mesh_cube(const Corner& origin) {
    std::array<Corner, 8> corners;
    std::array<double, 8> values{};
    for (unsigned k = 0; k < 8; ++k) {
      corners[k] = {origin[0] + (k & 1U), origin[1] + (k >> 1U & 1U), origin[2] + (k >> 2U)};
      values[k] = grid_.values()[number(corners[k])];
      if (std::isnan(values[k])) return;
    }
    std::map<Index, Index> next;  // of the zeros, around the faces
    for (const auto& side : kSides) {
      for (unsigned k = 0; k < 4; ++k) {
        if (values[side[k]] < 0 || values[side[(k + 1) % 4]] >= 0) continue;
        unsigned end = k + 1;
        while (values[side[(end + 1) % 4]] < 0) ++end;
        const Index in = zero(corners, values, side[k], side[(k + 1) % 4]),
                    out = zero(corners, values, side[end % 4], side[(end + 1) % 4]);
        next[in] = out;
      }
    }
    while (!next.empty()) {
      const Index first = next.begin()->first;
      Index second = take_next(next, first);
      for (Index third = take_next(next, second); third != first; third = take_next(next, third)) {
        mesh_.triangles.push_back({first, second, third});
        second = third;
      }
    }
  }

  static Index take_next(std::map<Index, Index>& next, Index of) {
    const auto found = next.find(of);
    const Index result = found->second;
    next.erase(found);
    return result;
  }

  std::size_t number(const Corner& corner) const { return grid_.number(corner[0], corner[1], corner[2]); }

  /// The vertex between two corners.
  Index zero(const std::array<Corner, 8>& corners, const std::array<double, 8>& values, unsigned a, unsigned b) {
    if (a > b) std::swap(a, b);
    const std::size_t edge = 8 * number(corners[a]) + (a ^ b);
    const auto [known, is_new] = vertices_.emplace(edge, static_cast<Index>(mesh_.positions.size()));
    if (is_new) {
      constexpr double kNearest = 0.02;  ///< to a corner, in voxels
      const double share = std::clamp(values[a] / (values[a] - values[b]), kNearest, 1 - kNearest);
      const auto place = [&](unsigned k) { return grid_.place(corners[k][0], corners[k][1], corners[k][2]); };
      mesh_.positions.push_back(place(a) + share * (place(b) - place(a)));
    }
    return known->second;
  }

  const Grid& grid_;
  Mesh mesh_;
  std::unordered_map<std::size_t, Index> vertices_;  ///< by the edge of the grid
};

/// The point of a triangle that is nearest to `p` [Ericson 2005, 5.1.5].
Vec3 nearest_on(const std::array<Vec3, 3>& corner, const Vec3& p) {
  const Vec3 ab = corner[1] - corner[0], ac = corner[2] - corner[0], normal = ab.cross(ac);
  const double squares = normal.squaredNorm();
  if (squares > 0) {
    const Vec3 ap = p - corner[0];
    const double second = ap.cross(ac).dot(normal) / squares, third = ab.cross(ap).dot(normal) / squares;
    if (std::min({second, third, 1 - second - third}) >= 0) return corner[0] + second * ab + third * ac;
  }
  Vec3 best = corner[0];
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 &from = corner[k], way = corner[(k + 1) % 3] - from;
    const double share = std::clamp((p - from).dot(way) / std::max(1e-300, way.squaredNorm()), 0.0, 1.0);
    const Vec3 spot = from + share * way;
    if ((spot - p).squaredNorm() < (best - p).squaredNorm()) best = spot;
  }
  return best;
}

/// Finds what is nearest on a mesh, up to a distance.
class NearestPoint {
 public:
  NearestPoint(const Mesh& mesh, double farthest) : mesh_(mesh), cell_(farthest) {
    for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
      Eigen::AlignedBox3d box;
      for (const Index v : mesh.triangles[f]) box.extend(mesh.positions[v]);
      const Cell low = cell_of(box.min() - Vec3::Constant(farthest)),
                 high = cell_of(box.max() + Vec3::Constant(farthest));
      for (int x = low[0]; x <= high[0]; ++x) {
        for (int y = low[1]; y <= high[1]; ++y) {
          for (int z = low[2]; z <= high[2]; ++z) faces_[{x, y, z}].push_back(f);
        }
      }
    }
  }

  std::optional<Vec3> operator()(const Vec3& p) const {
    const auto found = faces_.find(cell_of(p));
    if (found == faces_.end()) return std::nullopt;
    std::optional<Vec3> best;
    for (const std::size_t f : found->second) {
      const Triangle& face = mesh_.triangles[f];
      const Vec3 spot = nearest_on({mesh_.positions[face[0]], mesh_.positions[face[1]], mesh_.positions[face[2]]}, p);
      if (!best || (spot - p).squaredNorm() < (*best - p).squaredNorm()) best = spot;
    }
    return best;
  }

 private:
  using Cell = std::array<int, 3>;
  Cell cell_of(const Vec3& p) const {
    return {static_cast<int>(std::floor(p.x() / cell_)), static_cast<int>(std::floor(p.y() / cell_)),
            static_cast<int>(std::floor(p.z() / cell_))};
  }

  const Mesh& mesh_;
  double cell_;
  std::map<Cell, std::vector<std::size_t>> faces_;
};

}  // namespace

std::optional<DepthView> take_fused_scan(const Mesh& model, const FusedScan& scan, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const Mesh placed = unit_sized(model);
  Mesh mesh = MarchingCubes(fused_distances(placed, scan, random)).take();
  const NearestPoint nearest(placed, scan.reach / scan.voxels_across);
  std::vector<std::optional<Vec3>> feet;
  for (const Vec3& position : mesh.positions) feet.push_back(nearest(position));
  std::erase_if(mesh.triangles,
                [&](const Triangle& face) { return !feet[face[0]] || !feet[face[1]] || !feet[face[2]]; });
  return view_of(
      mesh.triangles, mesh.positions.size(), [&](Index v) { return *feet[v]; },
      [&](Index v) { return mesh.positions[v]; });
}

FusedScan random_fused_scan(std::mt19937_64& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  FusedScan scan;
  scan.voxels_across = 30 * std::pow(4.5, unit(random));
  scan.views = 1 + static_cast<int>(11 * std::pow(unit(random), 1.5));
  scan.spread = unit(random) < 0.4 ? 0.2 + 0.6 * unit(random) : std::numbers::pi;
  scan.pixels_across = scan.voxels_across * (0.8 + 1.2 * unit(random));
  scan.reach = 2.5 + 3 * unit(random);
  scan.misplacement = unit(random) < 0.5 ? 0.6 * unit(random) : 0;
  scan.noise = random_depth_noise(random);
  scan.noise.level *= std::sqrt(static_cast<double>(scan.views));
  return scan;
}

}  // namespace crease::quality
