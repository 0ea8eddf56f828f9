#include "core/measure/noise.h"

#include <Eigen/Geometry>
#include <cmath>
#include <string>

#include "core/base/random.h"
#include "core/error.h"
#include "core/mesh/position_index.h"
#include "core/mesh/topology.h"

namespace crease {
namespace {

/// Two independent N(0, 1) from two random words [Box & Muller 1958].
std::array<double, 2> normal_pair(std::uint32_t radius_word, std::uint32_t angle_word) {
  const double radius = std::sqrt(-2 * std::log(CounterRandom::unit(radius_word)));
  const double angle = 2 * M_PI * CounterRandom::unit(angle_word);
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

/// The first vertex at the position of each vertex.
std::vector<Index> first_at_place(const std::vector<Vec3>& positions) {
  PositionIndex places;
  places.reserve(positions.size(), positions);
  std::vector<Index> first(positions.size());
  for (Index vertex = 0; vertex < first.size(); ++vertex) first[vertex] = places.find_or_add(positions, vertex);
  return first;
}

/// Area-weighted normals of the vertices that are the first at their place, over the faces of all vertices there; zero
/// where these have no area.
std::vector<Vec3> vertex_normals(const Mesh& mesh, const Topology& topology, const std::vector<Index>& first,
                                 double length_unit) {
  std::vector<Vec3> normals(mesh.positions.size(), Vec3::Zero());
  for (std::size_t face = 0; face < mesh.triangles.size(); ++face) {
    const auto [a, b, c] = oriented(mesh, topology, face);
    // Divided before the product, which would overflow for coordinates near the largest number.
    const Vec3 ab = (mesh.positions[b] - mesh.positions[a]) / length_unit;
    const Vec3 ac = (mesh.positions[c] - mesh.positions[a]) / length_unit;
    const Vec3 twice_area = ab.cross(ac);
    for (const Index vertex : {a, b, c}) normals[first[vertex]] += twice_area;
  }
  for (Vec3& normal : normals) normal = normal.stableNormalized();
  return normals;
}

}  // namespace

NoiseKind noise_kind_from_name(std::string_view name) {
  if (name == "gaussian") return NoiseKind::kGaussian;
  if (name == "normal") return NoiseKind::kNormal;
  if (name == "impulsive") return NoiseKind::kImpulsive;
  throw Error::parameter(code::kParameterInvalid, "kind", std::string(name), "one of gaussian, normal, impulsive");
}

Mesh add_noise(const Mesh& mesh, double sigma, std::uint64_t seed, NoiseKind kind) {
  if (!(sigma >= 0 && std::isfinite(sigma))) {
    throw Error::parameter(code::kParameterOutOfRange, "sigma", std::to_string(sigma), "a finite number, 0 or more");
  }
  const Topology topology = build_topology(mesh);
  const double length_unit = mean_edge_length(mesh.positions, topology.edges);
  if (length_unit == 0) return mesh;
  const std::vector<Index> first_there = first_at_place(mesh.positions);
  const std::vector<Vec3> normals = vertex_normals(mesh, topology, first_there, length_unit);
  const CounterRandom random(static_cast<std::uint32_t>(seed), RandomStream::kNoise);
  const auto high_seed = static_cast<std::uint32_t>(seed >> 32);

  Mesh noisy = mesh;
  for (std::size_t vertex = 0; vertex < noisy.positions.size(); ++vertex) {
    const Index first_vertex = first_there[vertex];
    const auto words = random(high_seed, first_vertex);
    const auto [first, second] = normal_pair(words[0], words[1]);
    if (kind == NoiseKind::kGaussian) {
      const double third = normal_pair(words[2], words[3])[0];
      noisy.positions[vertex] += sigma * length_unit * Vec3(first, second, third);
    } else if (kind == NoiseKind::kNormal || CounterRandom::unit(words[2]) < 0.5) {
      noisy.positions[vertex] += sigma * length_unit * first * normals[first_vertex];
    }
  }
  return noisy;
}

}  // namespace crease
