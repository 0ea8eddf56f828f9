#include "core/classical/classical.h"

#include <chrono>
#include <cmath>
#include <variant>

#include "core/classical/methods.h"

namespace crease {
namespace {

std::uint32_t iterations_of(const ClassicalMethod& method) {
  const auto iterations = [](const auto& options) -> std::uint32_t {
    if constexpr (requires { options.iterations; }) {
      return options.iterations;
    } else {
      return 1;
    }
  };
  return std::visit(iterations, method);
}

bool has_extent(const Mesh& mesh, const Topology& topology) {
  const double length = mean_edge_length(mesh.positions, topology.edges);
  return length > 0 && std::isfinite(length);
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

ClassicalResult denoise(const Mesh& measured, const Topology& topology, const ClassicalMethod& method,
                        const ClassicalCallback& on_iteration) {
  const auto start = std::chrono::steady_clock::now();
  ClassicalResult result{.positions = measured.positions};
  if (has_extent(measured, topology)) {
    Surface surface(measured, topology);
    const std::uint32_t iterations = iterations_of(method);
    const ClassicalStep step = std::visit([&](const auto& options) { return make_step(surface, options); }, method);
    const auto positions = [&] { return surface.upload_positions(measured); };
    for (bool more = true; more && !result.cancelled && result.iterations < iterations;) {
      more = step();
      ++result.iterations;
      result.cancelled =
          on_iteration && !on_iteration({result.iterations, iterations, seconds_since(start), positions});
    }
    result.positions = surface.upload_positions(measured);
  }
  result.seconds = seconds_since(start);
  return result;
}

}  // namespace crease
