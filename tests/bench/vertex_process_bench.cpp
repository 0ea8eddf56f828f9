#include <benchmark/benchmark.h>

#include <fstream>
#include <iterator>

#include "core/energy/gradient.h"
#include "core/geometry/renumbering.h"
#include "core/io/decode.h"
#include "core/solve/vertex_process.h"
#include "tests/bench/textbook_sampler.h"
#include "tests/support/meshes.h"
#include "tests/support/smooth_support.h"

namespace crease::bench {
namespace {

constexpr double kTemperature = 0.01, kStep = 0.08;

MrfOptions bench_options() {
  MrfOptions options;
  options.likelihood_weight = 0.5;
  options.sharpness_weight = options.sharpness_threshold = 0.8;
  options.support_weight = 0.2;
  return options;
}

/// The noisy bunny if available, otherwise a sphere with about as many vertices. The edge length is about one.
const Mesh& bench_mesh() {
  static const Mesh mesh = [] {
    Mesh result = test::icosphere(6, 60);
    if (const auto path = test::development_mesh("Bunny0.2/noisy.obj")) {
      result = decode_mesh(test::read_file(*path), MeshFormat::kObj).mesh;
      const double unit = mean_edge_length(result.positions, build_topology(result).edges);
      for (Vec3& position : result.positions) position /= unit;
    }
    return result;
  }();
  return mesh;
}

/// Alternates the single-threaded textbook loop and the packed sampler. `ratio` compares their rates within one run.
void ratio_to_textbook(benchmark::State& state) {
  const Mesh& mesh = bench_mesh();
  TextbookSampler textbook(to_openmesh(mesh), bench_options().likelihood_weight);
  const Renumbering renumbering(mesh);
  const Topology topology = build_topology(renumbering.mesh);
  test::FieldWithEnergy bench(Field(renumbering.mesh, topology), bench_options());
  const Schedule schedule = schedule_vertices(renumbering.mesh, topology);
  ThreadTeam team(1);
  VertexProcess process(bench.field, bench.terms, schedule, team.size());
  const CounterRandom random(1, RandomStream::kVertexProcess);
  std::uint32_t sweep = 0;
  double textbook_seconds = 0, packed_seconds = 0;
  const auto seconds_of = [](auto&& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  for ([[maybe_unused]] auto _ : state) {
    textbook_seconds += seconds_of([&] { benchmark::DoNotOptimize(textbook.sweep(kTemperature, kStep)); });
    packed_seconds += seconds_of([&] {
      bench.terms.labels_changed(bench.field, team);
      benchmark::DoNotOptimize(process.sweep(bench.weights(), random, ++sweep, kTemperature, kStep, team));
    });
  }
  const auto proposals = static_cast<double>(state.iterations()) * static_cast<double>(mesh.positions.size());
  state.counters["textbook_per_s"] = proposals / textbook_seconds;
  state.counters["packed_per_s"] = proposals / packed_seconds;
  state.counters["ratio"] = textbook_seconds / packed_seconds;
}
BENCHMARK(ratio_to_textbook)->Unit(benchmark::kMillisecond)->MinTime(5);

/// Alternates a few sweeps with one thread and a few with two. `speedup` compares them within one run.
void speedup_of_second_thread(benchmark::State& state) {
  const Mesh& mesh = bench_mesh();
  const Renumbering renumbering(mesh);
  const Topology topology = build_topology(renumbering.mesh);
  test::FieldWithEnergy bench(Field(renumbering.mesh, topology), bench_options());
  const Schedule schedule = schedule_vertices(renumbering.mesh, topology);
  ThreadTeam one(1), two(2);
  VertexProcess process(bench.field, bench.terms, schedule, two.size());
  const CounterRandom random(1, RandomStream::kVertexProcess);
  std::uint32_t sweep = 0;
  std::array<double, 2> seconds{};
  for ([[maybe_unused]] auto _ : state) {
    for (const std::size_t i : {0U, 1U}) {
      const auto start = std::chrono::steady_clock::now();
      for (int k = 0; k < 10; ++k)
        process.sweep(bench.weights(), random, ++sweep, kTemperature, kStep, i == 0 ? one : two);
      seconds[i] += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    }
  }
  state.counters["speedup"] = seconds[0] / seconds[1];
}
BENCHMARK(speedup_of_second_thread)->Unit(benchmark::kMillisecond)->MinTime(5);

/// One evaluation of E with its gradient, as a descent asks for it.
template <typename Real>
void energy_with_gradient(benchmark::State& state) {
  const Mesh mesh = test::icosphere(5);  // 20,480 faces
  const Topology topology = build_topology(mesh);
  test::FieldWithEnergy bench(test::shaken_field(mesh, topology, 1), bench_options());
  std::vector<Real> x, gradient(3 * mesh.positions.size());
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    for (const Vec3& position : bench.field.positions) x.push_back(static_cast<Real>(position[axis]));
  }
  EnergyGradient<Real> energy(bench.field, bench.terms);
  for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(energy(bench.weights(), x, gradient, bench.alone));
  state.counters["faces_per_s"] =
      benchmark::Counter(static_cast<double>(mesh.triangles.size()), benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(energy_with_gradient<float>)->Unit(benchmark::kMicrosecond);
BENCHMARK(energy_with_gradient<double>)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace crease::bench
