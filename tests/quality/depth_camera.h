#pragma once

#include <cstdint>
#include <optional>
#include <random>

#include "core/mesh/mesh.h"
#include "tests/quality/depth_picture.h"

namespace crease::quality {

/// Where a camera stands that looks at the middle of a model.
struct DepthCamera {
  double pixels_across = 100;  ///< the larger side of the model in the picture
  double distance = 4;         ///< from the middle, in largest sides of the model
  double farthest_step = 6;    ///< pixels by which the corners of a face may differ in depth
};

/// What a camera sees of a model. The same seed turns the model alike and gives the same noise. None where the camera
/// sees hardly anything.
std::optional<DepthView> take_depth_view(const Mesh& model, const DepthCamera& camera, const DepthNoise& noise,
                                         std::uint64_t seed);

DepthCamera random_camera(std::mt19937_64& random);

}  // namespace crease::quality
