#pragma once

#include <cstdint>
#include <optional>
#include <random>

#include "tests/quality/depth_camera.h"

namespace crease::quality {

/// How a model is scanned: views of several cameras become one field of signed distances on a grid [Curless & Levoy
/// 1996], whose zeros are meshed by marching cubes, as KinectFusion does [Newcombe et al. 2011].
struct FusedScan {
  double voxels_across = 50;  ///< the larger side of the model, or of what is looked at
  int views = 6;
  double spread = 3.2;         ///< farthest angle between a camera and the first one, in radians
  double pixels_across = 100;  ///< of each picture
  double distance = 4;         ///< of the cameras from the middle, in largest sides of the model
  double farthest_step = 4;    ///< pixels by which depths may differ from those beside
  double reach = 4;            ///< distances are cut off here, in voxels
  double misplacement = 0;     ///< standard deviation of where a camera is taken to be, on each axis, in voxels
  DepthNoise noise = {};
};

/// The largest connected part of a scan, and the same faces with their corners on the model, each where the model is
/// nearest. The same seed turns the model alike and gives the same noise. None where hardly anything is seen.
std::optional<DepthView> take_fused_scan(const Mesh& model, const FusedScan& scan, std::uint64_t seed);

FusedScan random_fused_scan(std::mt19937_64& random);

}  // namespace crease::quality
