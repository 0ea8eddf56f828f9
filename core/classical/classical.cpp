#include "core/classical/classical.h"

#include <array>
#include <chrono>
#include <cmath>
#include <numbers>

#include "core/classical/methods.h"

namespace crease {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

struct Method {
  ClassicalStep (*make)(Surface&, const ClassicalOptions&);
  ClassicalOptions defaults;
};

/// In the order of ClassicalMethod.
constexpr std::array<Method, 8> kMethods{{
    {make_fuzzy_vector_median, {.iterations = 10, .normal_width = 20 * kDegree, .fitting_steps = 5}},
    {make_taubin, {.iterations = 15, .step = 0.6307, .passband = 0.1}},
    {make_mean_curvature_flow, {.iterations = 5, .step = 0.1}},
    {make_anisotropic_flow, {.iterations = 10, .step = 0.1, .normal_width = 80 * kDegree}},
    {make_normal_diffusion, {.iterations = 5, .step = 2, .normal_width = 20 * kDegree, .fitting_steps = 20}},
    {make_non_iterative, {.spatial_width = 1.5, .range_width = 0.7}},
    {make_bilateral, {.iterations = 3, .spatial_width = 1, .range_width = 0.3}},
    {make_diebel, {.iterations = 150, .likelihood_weight = 2}},
}};

const Method& entry(ClassicalMethod method) { return kMethods.at(static_cast<std::size_t>(method)); }

ClassicalOptions resolved(ClassicalOptions options, const ClassicalOptions& defaults) {
  const auto resolve = [&](auto member) {
    if (options.*member == 0) options.*member = defaults.*member;
  };
  using O = ClassicalOptions;
  for (const auto member : {&O::iterations, &O::fitting_steps}) resolve(member);
  for (const auto member :
       {&O::step, &O::passband, &O::spatial_width, &O::range_width, &O::normal_width, &O::likelihood_weight}) {
    resolve(member);
  }
  return options;
}

bool has_extent(const Mesh& mesh, const Topology& topology) {
  const double length = mean_edge_length(mesh.positions, topology.edges);
  return length > 0 && std::isfinite(length);
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

ClassicalOptions default_options(ClassicalMethod method) { return entry(method).defaults; }

ClassicalResult denoise(const Mesh& measured, const Topology& topology, ClassicalMethod method,
                        const ClassicalOptions& options, const ClassicalCallback& on_iteration) {
  const auto start = std::chrono::steady_clock::now();
  ClassicalResult result{.positions = measured.positions};
  if (has_extent(measured, topology)) {
    Surface surface(measured, topology);
    const ClassicalOptions chosen = resolved(options, default_options(method));
    const std::uint32_t iterations = method == ClassicalMethod::kNonIterative ? 1 : chosen.iterations;
    const ClassicalStep step = entry(method).make(surface, chosen);
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
