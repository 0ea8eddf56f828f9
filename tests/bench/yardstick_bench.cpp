#include <benchmark/benchmark.h>

#include "core/base/heap.h"
#include "core/base/stopwatch.h"
#include "core/io/decode.h"
#include "core/measure/noise.h"
#include "core/smooth/smooth.h"
#include "tests/quality/yardsticks.h"
#include "tests/support/meshes.h"

namespace crease::bench {
namespace {

/// Alternates bilateral normal filtering (20 normal and 10 vertex iterations) and the default method on a noisy
/// fandisk, one thread each, with the heap that the programs have. `ratio` compares their times within one run.
void default_against_bilateral_normals(benchmark::State& state) {
  reserve_heap(half_of_memory());
  const auto path = test::cgal_mesh("fandisk.off");
  if (!path) {
    state.SkipWithError("libcgal-demo is not installed");
    return;
  }
  const Mesh original = decode_mesh(test::read_file(*path), MeshFormat::kOff).mesh;
  const Mesh noisy = add_noise(original, 0.3, 1, NoiseKind::kNormal);
  const Topology topology = build_topology(noisy);
  double yardstick_seconds = 0, default_seconds = 0;
  for (auto _ : state) {
    const Stopwatch yardstick;
    benchmark::DoNotOptimize(quality::filter_bilateral_normals(noisy, topology, {}));
    yardstick_seconds += yardstick.seconds();
    const Stopwatch ours;
    RunContext context;
    benchmark::DoNotOptimize(smooth(noisy, topology, {.method = MrfOptions{}, .threads = 1}, context));
    default_seconds += ours.seconds();
  }
  const auto runs = static_cast<double>(state.iterations());
  state.counters["yardstick_s"] = yardstick_seconds / runs;
  state.counters["default_s"] = default_seconds / runs;
  state.counters["ratio"] = default_seconds / yardstick_seconds;
}
BENCHMARK(default_against_bilateral_normals)->Unit(benchmark::kMillisecond)->MinTime(3);

}  // namespace
}  // namespace crease::bench
