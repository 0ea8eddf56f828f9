#include "core/choice/noise_spectrum.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numbers>
#include <utility>

#include "core/base/quantile.h"
#include "core/base/random.h"
#include "core/choice/scan_error.h"
#include "core/mesh/face_vectors.h"

namespace crease {
namespace {

constexpr std::array<int, NoiseSpectrum{}.bands.size()> kBands = {1, 2, 4, 8, 16, 32, 64};
/// How much the density must grow from the first band to the second, and on to the third. That of white noise does not
/// grow, and with a shape beside it more slowly than that of correlated noise.
constexpr std::array<double, 2> kLeastGrowth = {1.3, 1.6}, kLeastGrowthOfOneView = {1.1, 1.1};
constexpr std::size_t kLeastVertices = 1000;
constexpr double kLeastDensity = 1e-9;
/// More exact flats than this are those of a surface without noise. Scanners that round leave some, too, but then there
/// is noise around them, with a density of kLeastNoise and more. In one view any number of them may be rounded, but
/// hardly half of it.
bool is_without_noise(const CaptureSigns& capture, const Density& finest) {
  constexpr double kFewFlats = 0.02, kManyFlats = 0.15, kLeastNoise = 1e-3, kNone = 1e-6;
  if (capture.is_one_view()) return capture.exact_flats > kFewFlats && finest.half < kNone;
  return capture.exact_flats > (finest.low < kLeastNoise ? kFewFlats : kManyFlats);
}

/// A standard normal number for each vertex.
std::vector<double> white_noise(std::size_t vertices, std::uint32_t seed, std::uint32_t number) {
  const CounterRandom random(seed, RandomStream::kProbe);
  std::vector<double> noise(vertices);
  for (std::size_t v = 0; v < vertices; ++v) {
    const auto words = random(number + 1, static_cast<std::uint32_t>(v));  // 0 is that of the signs
    noise[v] = std::sqrt(-2 * std::log(CounterRandom::unit(words[0]))) *
               std::cos(2 * std::numbers::pi * CounterRandom::unit(words[1]));
  }
  return noise;
}

double square(double x) { return x * x; }

/// Values after ever more steps of a walk; each goes on from one before.
template <typename Value>
class WalkSeries {
 public:
  WalkSeries(const LazyWalk& walk, std::vector<Value> values) : walk_(walk) { kept_.emplace(0, std::move(values)); }

  /// Valid until the next band.
  const std::vector<Value>& after(int steps) {
    const auto before = std::prev(kept_.upper_bound(steps));
    if (before->first == steps) return before->second;
    return kept_.emplace(steps, walk_.after(before->second, steps - before->first)).first->second;
  }

  /// Second differences of the values after t, 2t and 3t steps. Bands are asked for from the finest on.
  std::vector<Value> band(int t) {
    kept_.erase(kept_.begin(), std::prev(kept_.upper_bound(t)));
    const std::vector<Value>&first = after(t), &second = after(2 * t);
    std::vector<Value> band = after(3 * t);
    for (std::size_t v = 0; v < band.size(); ++v) band[v] += first[v] - 2.0 * second[v];
    return band;
  }

 private:
  const LazyWalk& walk_;
  std::map<int, std::vector<Value>> kept_;  ///< by the number of steps
};

class Spectrometer {
 public:
  Spectrometer(const Surface& surface, ThreadTeam& team)
      : surface_(surface),
        walk_(surface, team),
        series_(walk_, with_probe(surface.measured)),
        inner_(inner_vertices(surface.topology)) {}

  /// Bands are asked for from the finest on.
  Density density(int t) {
    const std::vector<Eigen::Array4d> band = series_.band(t);
    const std::vector<Vec3> normals = normals_of(series_.after(t));
    std::vector<Eigen::Array2d> energies(band.size());
    for (std::size_t v = 0; v < band.size(); ++v) {
      energies[v] = {square(band[v].head<3>().matrix().dot(normals[v])), square(band[v][3])};
    }
    energies = walk_.after(std::move(energies), 2 * t);
    const std::vector<std::uint8_t> counts = far_from_border(t);
    std::vector<double> ours, theirs;
    for (std::size_t v = 0; v < energies.size(); ++v) {
      if (counts[v] == 0) continue;
      ours.push_back(energies[v][0]);
      theirs.push_back(energies[v][1]);
    }
    constexpr std::array kShares{0.1, 0.25, 0.5, 0.75};
    std::array<double, kShares.size()> ratios = quantiles(std::move(ours), kShares);
    const auto below = quantiles(std::move(theirs), kShares);
    for (std::size_t k = 0; k < ratios.size(); ++k) ratios[k] /= below[k] + 1e-300;
    return {std::max(kLeastDensity, ratios[0]), ratios[1], ratios[2], ratios[3]};
  }

  const LazyWalk& walk() const { return walk_; }

 private:
  static constexpr std::uint32_t kSeed = 11;

  /// Positions, and white noise to compare them with.
  static std::vector<Eigen::Array4d> with_probe(const std::vector<Vec3>& positions) {
    const std::vector<double> probe = white_noise(positions.size(), kSeed, 0);
    std::vector<Eigen::Array4d> fields(positions.size());
    for (std::size_t v = 0; v < fields.size(); ++v) fields[v] << positions[v].array(), probe[v];
    return fields;
  }

  std::vector<Vec3> normals_of(const std::vector<Eigen::Array4d>& smooth) const {
    std::vector<Vec3> normals(smooth.size(), Vec3::Zero());
    const auto at = [&](Index v) -> Vec3 { return smooth[v].head<3>().matrix(); };
    for (const Triangle& face : surface_.faces) {
      const Vec3 area = area_vector(at(face[0]), at(face[1]), at(face[2]));
      for (const Index v : face) normals[v] += area;
    }
    for (Vec3& normal : normals) normal = direction(normal);
    return normals;
  }

  /// 1 where the filters do not reach the border; everywhere if that leaves too little.
  std::vector<std::uint8_t> far_from_border(int t) const {
    std::vector<std::uint8_t> far = inner_;
    for (int ring = 0; ring < std::max(1, static_cast<int>(std::sqrt(t))); ++ring) {
      std::vector<std::uint8_t> next = far;
      for (std::size_t v = 0; v < far.size(); ++v) {
        if (far[v] != 0) continue;
        surface_.visit_vertex_neighbors(static_cast<Index>(v), [&](Index other) { next[other] = 0; });
      }
      far.swap(next);
    }
    const auto left = static_cast<std::size_t>(std::ranges::count(far, std::uint8_t{1}));
    if (4 * left <= far.size()) std::ranges::fill(far, std::uint8_t{1});
    return far;
  }

  const Surface& surface_;
  LazyWalk walk_;
  WalkSeries<Eigen::Array4d> series_;
  std::vector<std::uint8_t> inner_;
};

constexpr std::size_t kParts = NoiseSpectrum::kSteps.size();
using Parts = Eigen::Array<double, kParts, 1>;

/// White noise after the steps of each part of a spectrum.
std::vector<Parts> smoothed_noise(const LazyWalk& walk, std::size_t vertices) {
  WalkSeries<double> series(walk, white_noise(vertices, 5, 0));
  std::vector<Parts> fields(vertices);
  for (std::size_t part = 0; part < kParts; ++part) {
    const std::vector<double>& smooth = series.after(NoiseSpectrum::kSteps[part]);
    for (std::size_t v = 0; v < vertices; ++v) fields[v][static_cast<Eigen::Index>(part)] = smooth[v];
  }
  return fields;
}

/// Non-negative least squares of the relative misfit, one variance after the other.
std::array<double, kParts> fitted(const LazyWalk& walk, std::size_t vertices,
                                  const std::array<double, kBands.size()>& density) {
  const auto energies = [](const std::vector<Parts>& fields) {
    Parts sum = Parts::Zero();
    for (const Parts& field : fields) sum += field.square();
    return sum;
  };
  std::vector<Parts> noise = smoothed_noise(walk, vertices);
  const Parts whole = energies(noise);
  WalkSeries<Parts> series(walk, std::move(noise));
  std::array<Parts, kBands.size()> response;
  for (std::size_t band = 0; band < kBands.size(); ++band) response[band] = energies(series.band(kBands[band])) / whole;
  std::array<double, kParts> variances{};
  constexpr int kMostPasses = 3000;
  for (int pass = 0; pass < kMostPasses; ++pass) {
    for (std::size_t part = 0; part < kParts; ++part) {
      double squares = 0, misfit = 0;
      for (std::size_t band = 0; band < kBands.size(); ++band) {
        const auto relative = [&](std::size_t k) {
          return response[band][static_cast<Eigen::Index>(k)] / response[band][0] / density[band];
        };
        double error = -1;
        for (std::size_t k = 0; k < kParts; ++k) error += variances[k] * relative(k);
        squares += relative(part) * relative(part);
        misfit += relative(part) * error;
      }
      if (squares > 0) variances[part] = std::max(0.0, variances[part] - misfit / squares);
    }
  }
  return variances;
}

}  // namespace

double NoiseSpectrum::sigma() const {
  double sum = 0;
  for (const double variance : variances) sum += variance;
  return std::sqrt(sum);
}

double NoiseSpectrum::length() const {
  double sum = 0, weighted = 0;
  for (std::size_t k = 0; k < variances.size(); ++k) {
    sum += variances[k];
    weighted += variances[k] * std::sqrt(kSteps[k] / 2.0);
  }
  return sum > 0 ? weighted / sum : 0;
}

std::vector<double> NoiseSpectrum::sample(const LazyWalk& walk, std::size_t vertices, std::uint32_t seed) const {
  std::vector<double> sum(vertices, 0);
  for (std::size_t part = 0; part < variances.size(); ++part) {
    if (!(variances[part] > 0)) continue;
    const std::vector<double> smooth =
        walk.after(white_noise(vertices, seed, static_cast<std::uint32_t>(part)), kSteps[part]);
    double squares = 0;
    for (const double value : smooth) squares += value * value / static_cast<double>(vertices);
    const double scale = std::sqrt(variances[part] / squares);
    for (std::size_t v = 0; v < vertices; ++v) sum[v] += scale * smooth[v];
  }
  return sum;
}

std::optional<NoiseSpectrum> find_correlated_noise(const Surface& surface, bool force, ThreadTeam& team) {
  constexpr double kLargestGrowth = 2.7;
  if (!force && surface.measured.size() < kLeastVertices) return std::nullopt;
  Spectrometer spectrometer(surface, team);
  NoiseSpectrum found;
  found.capture = capture_signs(surface);
  std::array<Density, kBands.size()>& bands = found.bands;
  const auto& least_growth = found.capture.is_one_view() ? kLeastGrowthOfOneView : kLeastGrowth;
  for (std::size_t k = 0; k < kBands.size(); ++k) {
    bands[k] = spectrometer.density(kBands[k]);
    if (force) continue;
    if (k == 0 && is_without_noise(found.capture, bands[0])) return std::nullopt;
    if (k > 0 && k <= least_growth.size() && bands[k].low < least_growth[k - 1] * bands[k - 1].low) return std::nullopt;
    if (k + 1 == kTellingBands && !may_be_correlated(found)) return std::nullopt;
  }
  std::array<double, kBands.size()> density{};
  for (std::size_t k = 0; k < density.size(); ++k) {
    density[k] = std::max(kLeastDensity, std::sqrt(bands[k].quarter * bands[k].half));
    if (k > 0) density[k] = std::min(density[k], kLargestGrowth * density[k - 1]);
  }
  found.variances = fitted(spectrometer.walk(), surface.measured.size(), density);
  return found;
}

}  // namespace crease
