#include "core/io/write_number.h"

#include <fmt/format.h>

#include <limits>

#include "core/error.h"

namespace crease {

std::array<float, 3> to_single(const Vec3& position, std::size_t vertex) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  if (!(position.cwiseAbs().maxCoeff() <= kLargest)) {
    throw Error(code::kMeshUnsupported,
                fmt::format("vertex {} at ({}, {}, {}) is out of range: this format has single precision", vertex,
                            position.x(), position.y(), position.z()),
                fmt::format("vertex {}", vertex));
  }
  return {static_cast<float>(position.x()), static_cast<float>(position.y()), static_cast<float>(position.z())};
}

}  // namespace crease
