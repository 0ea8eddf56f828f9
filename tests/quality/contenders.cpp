#include "tests/quality/contenders.h"

#include <limits>
#include <sstream>
#include <stdexcept>

#include "core/base/stopwatch.h"
#include "core/job.h"
#include "core/options/parameters.h"
#include "tests/quality/yardsticks.h"

namespace crease::quality {
namespace {

/// What an upload comes to.
Denoised run_core(const Pair& pair, const SmoothOptions& options) {
  RunContext context;
  JobOutput output = run_job(check_mesh(pair.noisy), options, context);
  return {std::move(output.result.mesh.positions), std::move(output.result.labels), output.facts.seconds};
}

SmoothOptions parse_options(const std::string& text, std::uint32_t threads) {
  ParameterValues values;
  std::istringstream words(text == "default" ? "method=mrf" : text);
  for (std::string word; std::getline(words, word, ',');) {
    const auto equals = word.find('=');
    if (equals == std::string::npos) throw std::invalid_argument("no method is called " + text);
    const std::string name = word.substr(0, equals);
    values[name] = parse_value(find_parameter(name), word.substr(equals + 1));
  }
  SmoothOptions options = resolve_parameters(values).options.smooth;
  options.threads = threads;
  return options;
}

/// Keeps the positions with the least normal error. Its seconds are those of the whole search.
class Search {
 public:
  explicit Search(const Pair& pair) : pair_(pair) {}

  void consider(const std::vector<Vec3>& positions) {
    const double error = measure(pair_.original, {positions, pair_.original.triangles}).mean_normal_error_deg;
    if (error >= least_) return;
    least_ = error;
    best_ = positions;
  }
  Denoised result() const { return {best_, {}, stopwatch_.seconds()}; }

 private:
  const Pair& pair_;
  Stopwatch stopwatch_;
  double least_ = std::numeric_limits<double>::infinity();
  std::vector<Vec3> best_;
};

Denoised search_bilateral(const Pair& pair, const Topology& topology) {
  Search search(pair);
  for (const double width : {0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.55, 0.7}) {
    for (const int iterations : {2, 5, 10, 20, 40}) {
      for (const int vertex_iterations : {10, 20}) {
        search.consider(filter_bilateral_normals(
            pair.noisy, topology,
            {.range_width = width, .normal_iterations = iterations, .vertex_iterations = vertex_iterations}));
      }
    }
  }
  return search.result();
}

/// The results of fewer iterations are on the way.
Denoised search_guided(const Pair& pair, const Topology& topology) {
  Search search(pair);
  for (const double width : {0.2, 0.25, 0.3, 0.35, 0.45, 0.55}) {
    filter_guided_normals(pair.noisy, topology, {.range_width = width, .iterations = 40},
                          [&](int iteration, const std::vector<Vec3>& positions) {
                            if (iteration == 2 || iteration % 5 == 0) search.consider(positions);
                          });
  }
  return search.result();
}

Denoised timed(const std::function<std::vector<Vec3>()>& filter) {
  const Stopwatch stopwatch;
  std::vector<Vec3> positions = filter();
  return {std::move(positions), {}, stopwatch.seconds()};
}

}  // namespace

Contender find_contender(const std::string& name, std::uint32_t threads) {
  if (name == "noisy") {
    return {name, [](const Pair& pair, const Topology&) { return Denoised{pair.noisy.positions, {}, 0}; }};
  }
  if (name == "bilateral") {
    return {name, [](const Pair& pair, const Topology& topology) {
              return timed([&] { return filter_bilateral_normals(pair.noisy, topology, {}); });
            }};
  }
  if (name == "guided") {
    return {name, [](const Pair& pair, const Topology& topology) {
              return timed([&] { return filter_guided_normals(pair.noisy, topology, {}); });
            }};
  }
  if (name == "bilateral-best") return {name, search_bilateral};
  if (name == "guided-best") return {name, search_guided};
  return {name, [options = parse_options(name, threads)](const Pair& pair, const Topology&) {
            return run_core(pair, options);
          }};
}

}  // namespace crease::quality
