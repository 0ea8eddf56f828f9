#pragma once

#include <Eigen/Dense>
#include <functional>
#include <limits>
#include <optional>
#include <random>
#include <vector>

#include "core/mesh/mesh.h"

namespace crease::quality {

/// How a depth camera errs along its rays. Lengths are in pixels of the middle of the view.
struct DepthNoise {
  double level = 0;               ///< standard deviation
  double fine_width = 0;          ///< of the Gaussian that smooths the fine part; 0 leaves it white
  double broad_width = 3;         ///< of the one that smooths the broad part
  double broad_share = 0;         ///< of the broad part in the variance
  double growth_with_slope = 0;   ///< by how much the level grows where depth changes by a pixel from pixel to pixel
  double step = 0;                ///< to which depths are rounded; 0 for none
  bool rounds_disparity = false;  ///< in place of the depth, one over it, as structured light does
};

/// At random: half of the noise of one width, half with broad parts as well; some rounded.
DepthNoise random_depth_noise(std::mt19937_64& random);

/// A depth for each pixel, by row and column.
using Picture = Eigen::ArrayXXd;
inline constexpr double kNothing = std::numeric_limits<double>::infinity();

/// What a camera with a pinhole sees of models whose larger side is 1, from `distance` away. The middle of the picture
/// is on its axis.
class Rays {
 public:
  Rays(double pixels_across, double distance);

  Vec3 point(Eigen::Index row, Eigen::Index column, double depth) const;
  /// Where a point is in the picture, as column and row.
  Eigen::Vector2d pixel_of(const Vec3& point) const;
  Picture depths_of(const Mesh& mesh) const;

 private:
  void draw(const Mesh& mesh, const Triangle& face, Picture& depths) const;

  double focal_;
  Eigen::Index half_;
};

/// `pixel` is the size of one where the model is, in sides of the model.
Picture with_depth_noise(const Picture& depths, const DepthNoise& noise, double pixel, double distance,
                         std::mt19937_64& random);

Eigen::Quaterniond random_turn(std::mt19937_64& random);

/// What is seen of a model, without noise and with it. The meshes have the same faces.
struct DepthView {
  Mesh original, noisy;
};

/// The largest part of the faces that hangs together by corners. These are numbers below `corners`; `original` and
/// `noisy` say where they are. None where there is hardly anything.
std::optional<DepthView> view_of(const std::vector<Triangle>& faces, std::size_t corners,
                                 const std::function<Vec3(Index)>& original, const std::function<Vec3(Index)>& noisy);

}  // namespace crease::quality
