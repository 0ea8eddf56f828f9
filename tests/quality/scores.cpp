#include "tests/quality/scores.h"

#include <algorithm>
#include <cmath>

#include "core/options/options.h"

namespace crease::quality {
namespace {

std::size_t count_flipped(const Mesh& original, const Topology& topology, const std::vector<Vec3>& positions) {
  const std::vector<Vec3> expected = face_normals(original, topology, original.positions);
  const std::vector<Vec3> found = face_normals(original, topology, positions);
  std::size_t flipped = 0;
  for (std::size_t face = 0; face < found.size(); ++face) flipped += expected[face].dot(found[face]) < 0 ? 1 : 0;
  return flipped;
}

Reliability reliability_of(const Mesh& original, const Topology& topology, const std::vector<double>& labels) {
  const std::vector<double> angles = signed_dihedral_angles(original, topology, original.positions);
  Reliability reliability;
  for (std::size_t edge = 0; edge < labels.size(); ++edge) {
    if (!topology.is_interior(edge)) continue;
    reliability.add(labels[edge], std::abs(angles[edge]) > kReferenceRidgeDeg * kDegree);
  }
  return reliability;
}

}  // namespace

void Reliability::add(double label, bool is_ridge) {
  const auto last = static_cast<double>(bins.size() - 1);
  Bin& bin = bins[static_cast<std::size_t>(std::clamp(label * (last + 1), 0.0, last))];
  bin.label_sum += label;
  bin.ridges += is_ridge ? 1 : 0;
  ++bin.count;
}

void Reliability::add(const Reliability& other) {
  for (std::size_t k = 0; k < bins.size(); ++k) {
    bins[k].label_sum += other.bins[k].label_sum;
    bins[k].ridges += other.bins[k].ridges;
    bins[k].count += other.bins[k].count;
  }
}

double Reliability::calibration_error() const {
  double sum = 0, count = 0;
  for (const Bin& bin : bins) {
    sum += std::abs(bin.label_sum - static_cast<double>(bin.ridges));
    count += static_cast<double>(bin.count);
  }
  return count > 0 ? sum / count : 0;
}

Scores score(const Pair& pair, const Topology& topology, const Denoised& result) {
  Scores scores;
  const EdgeLabels labels{topology.edges, result.labels};
  scores.measured =
      measure(pair.original, {result.positions, pair.original.triangles}, result.labels.empty() ? nullptr : &labels);
  scores.flipped_faces = count_flipped(pair.original, topology, result.positions);
  if (!result.labels.empty()) scores.reliability = reliability_of(pair.original, topology, result.labels);
  scores.seconds = result.seconds;
  return scores;
}

double geometric_mean(std::span<const double> values, double floor) {
  double sum = 0;
  for (const double value : values) sum += std::log(std::max(value, floor));
  return values.empty() ? 0 : std::exp(sum / static_cast<double>(values.size()));
}

}  // namespace crease::quality
