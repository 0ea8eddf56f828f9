#pragma once

#include <cstdint>
#include <optional>
#include <random>

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

/// Where a camera stands that looks at the middle of a model.
struct DepthCamera {
  double pixels_across = 100;  ///< the larger side of the model in the picture
  double distance = 4;         ///< from the middle, in largest sides of the model
  double farthest_step = 6;    ///< pixels by which the corners of a face may differ in depth
};

/// What a camera sees of a model, without noise and with it: the largest connected part of the grid of its pixels.
/// The meshes have the same faces.
struct DepthView {
  Mesh original, noisy;
};

/// The same seed turns the model alike and gives the same noise. None where the camera sees hardly anything.
std::optional<DepthView> take_depth_view(const Mesh& model, const DepthCamera& camera, const DepthNoise& noise,
                                         std::uint64_t seed);

/// A camera and noise at random: half of the noise of one width, half with broad parts as well; some rounded.
DepthCamera random_camera(std::mt19937_64& random);
DepthNoise random_depth_noise(std::mt19937_64& random);

}  // namespace crease::quality
