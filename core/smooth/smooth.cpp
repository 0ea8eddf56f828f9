#include "core/smooth/smooth.h"

#include <type_traits>
#include <variant>

#include "core/smooth/apart.h"
#include "core/smooth/classical/classical.h"
#include "core/solve/anneal.h"

namespace crease {
namespace {

/// The energy of Diebel et al. 2006 is the one of the field with the square root as potential and without labels.
MrfOptions as_mrf(const DiebelOptions& options) {
  MrfOptions mrf;
  mrf.process = Process::kVertex;
  mrf.conjugate_gradients = true;
  mrf.sweeps = options.iterations;
  mrf.likelihood_weight = mrf.likelihood_weight_start = options.likelihood_weight;
  mrf.smoothness = Smoothness::kSquareRoot;
  mrf.edge_process = false;
  mrf.boundaries_stay = true;
  return mrf;
}

template <typename Options>
std::uint32_t iterations_of(const Options& options) {
  if constexpr (requires { options.iterations; }) return options.iterations;
  return 1;
}

}  // namespace

SmoothResult smooth(const Mesh& measured, const Topology& topology, const SmoothOptions& options, RunContext& context,
                    std::span<const double> weights) {
  if (!has_extent(measured, topology)) {
    SmoothResult unchanged;
    unchanged.positions = measured.positions;
    unchanged.labels.assign(topology.edges.size(), 0);
    const auto* mrf = std::get_if<MrfOptions>(&options.method);
    if (mrf != nullptr && mrf->uncertainty) unchanged.sigma.assign(measured.positions.size(), 0);
    return unchanged;
  }
  return std::visit(
      [&]<typename Options>(const Options& method) {
        if constexpr (std::is_same_v<Options, MrfOptions>) {
          const auto engine = method.solver == Solver::kDescent ? smooth_apart : anneal;
          return engine(measured, topology, method, options.threads, context, weights);
        } else if constexpr (std::is_same_v<Options, DiebelOptions>) {
          return anneal(measured, topology, as_mrf(method), options.threads, context, {});
        } else {
          const auto make = [&](PinnedSurface& surface) { return make_step(surface, method); };
          return iterate(measured, topology, iterations_of(method), make, context);
        }
      },
      options.method);
}

}  // namespace crease
