#include "core/measure/samples.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "core/measure/noise.h"
#include "core/mesh/topology.h"

namespace crease {
namespace {

constexpr std::uint64_t kSeed = 7;

// The part. Rings of points, each at one height, that straight faces join; the last joins the first.

constexpr Index kRingPoints = 108;  // a multiple of the six corners
constexpr double kSpacing = 0.045;

struct Ring {
  double radius, height;
  bool hexagonal = false;
};

constexpr std::array<Ring, 7> kRings = {
    {{0.40, 0}, {1.00, 0, true}, {1.00, 0.42, true}, {0.68, 0.42}, {0.68, 0.95}, {0.60, 1.03}, {0.40, 1.03}}};

Vec3 on_circle(double radius, double turn, double height) {
  return {radius * std::cos(2 * M_PI * turn), radius * std::sin(2 * M_PI * turn), height};
}

Vec3 on_ring(const Ring& ring, Index point) {
  const double turn = static_cast<double>(point) / kRingPoints;
  if (!ring.hexagonal) return on_circle(ring.radius, turn, ring.height);
  const double corner = std::floor(6 * turn), along = 6 * turn - corner;
  return (1 - along) * on_circle(ring.radius, corner / 6, ring.height) +
         along * on_circle(ring.radius, (corner + 1) / 6, ring.height);
}

Mesh clean_part() {
  Mesh mesh;
  for (std::size_t k = 0; k < kRings.size(); ++k) {
    const Ring &from = kRings.at(k), &to = kRings.at((k + 1) % kRings.size());
    const double length = std::hypot(to.radius - from.radius, to.height - from.height);
    const int steps = std::max(2, static_cast<int>(std::lround(length / kSpacing)));
    for (int step = 0; step < steps; ++step) {
      const double t = static_cast<double>(step) / steps;
      for (Index i = 0; i < kRingPoints; ++i) {
        mesh.positions.emplace_back((1 - t) * on_ring(from, i) + t * on_ring(to, i));
      }
    }
  }
  const auto count = static_cast<Index>(mesh.positions.size());
  for (Index start = 0; start < count; start += kRingPoints) {
    for (Index i = 0; i < kRingPoints; ++i) {
      const Index j = (i + 1) % kRingPoints, above = (start + kRingPoints) % count;
      const Index a = start + i, b = start + j, c = above + j, d = above + i;
      if ((i + start / kRingPoints) % 2 == 0) {
        mesh.triangles.push_back({a, b, c});
        mesh.triangles.push_back({a, c, d});
      } else {
        mesh.triangles.push_back({a, b, d});
        mesh.triangles.push_back({b, c, d});
      }
    }
  }
  return mesh;
}

// The scan: an icosahedron, divided five times, each point moved along its ray.

constexpr int kDivisions = 5;

class Icosphere {
 public:
  Icosphere() {
    const double g = (1 + std::sqrt(5.0)) / 2;
    for (const double one : {-1.0, 1.0}) {
      for (const double golden : {-g, g}) {
        add({0, one, golden});
        add({one, golden, 0});
        add({golden, 0, one});
      }
    }
    // The faces are the triples of corners that are as close to each other as neighbours are.
    for (Index a = 0; a < 12; ++a) {
      for (Index b = a + 1; b < 12; ++b) {
        for (Index c = b + 1; c < 12; ++c) {
          if (adjacent(a, b) && adjacent(b, c) && adjacent(c, a)) add_outward({a, b, c});
        }
      }
    }
  }

  void divide() {
    std::map<std::pair<Index, Index>, Index> middles;
    std::vector<Triangle> finer;
    for (const auto& [a, b, c] : mesh_.triangles) {
      const Index ab = middle(middles, a, b), bc = middle(middles, b, c), ca = middle(middles, c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    mesh_.triangles = std::move(finer);
  }

  Mesh take() { return std::move(mesh_); }

 private:
  Index add(const Vec3& direction) {
    mesh_.positions.push_back(direction.normalized());
    return static_cast<Index>(mesh_.positions.size() - 1);
  }

  bool adjacent(Index a, Index b) const { return mesh_.positions[a].dot(mesh_.positions[b]) > 0.4; }

  void add_outward(Triangle t) {
    const auto& p = mesh_.positions;
    Eigen::Matrix3d corners;
    corners << p[t[0]], p[t[1]], p[t[2]];
    if (corners.determinant() < 0) std::swap(t[1], t[2]);
    mesh_.triangles.push_back(t);
  }

  Index middle(std::map<std::pair<Index, Index>, Index>& middles, Index a, Index b) {
    const auto [found, is_new] = middles.try_emplace(std::minmax(a, b), 0);
    if (is_new) found->second = add(mesh_.positions[a] + mesh_.positions[b]);
    return found->second;
  }

  Mesh mesh_;
};

/// The surface of the pumpkin on the ray along `direction`.
Vec3 on_pumpkin(const Vec3& direction) {
  const double from_pole = std::acos(std::clamp(direction.z(), -1.0, 1.0));
  const double around = std::atan2(direction.y(), direction.x());
  const double girth = std::sin(from_pole);
  const auto bump = [](double x, double width) { return std::exp(-(x * x) / (width * width)); };
  const double ribs = 0.16 * girth * (std::sqrt(std::abs(std::cos(5 * around)) + 0.02) - 0.75);
  const double hollows = -0.30 * bump(from_pole, 0.42) - 0.22 * bump(M_PI - from_pole, 0.40);
  const double stem = 0.42 * bump(from_pole, 0.16);
  Vec3 point = (1 + ribs + hollows + stem) * direction;
  point.z() *= 0.82;
  return point;
}

/// Means over the neighbours, so that what is left of `values` is correlated over some edges.
std::vector<Vec3> spread(const std::vector<Vec3>& values, const Topology& topology) {
  std::vector<Vec3> means(values.size());
  for (std::size_t vertex = 0; vertex < values.size(); ++vertex) {
    Vec3 sum = values[vertex];
    const auto edges = topology.vertex_edges[vertex];
    for (const Index edge : edges) sum += values[other_end(topology.edges[edge], static_cast<Index>(vertex))];
    means[vertex] = sum / static_cast<double>(edges.size() + 1);
  }
  return means;
}

}  // namespace

Mesh sample_part() { return add_noise(clean_part(), 0.2, kSeed, NoiseKind::kNormal); }

Mesh sample_scan() {
  constexpr double kSigma = 0.7;  // before it is spread, which leaves about a third
  Icosphere sphere;
  for (int i = 0; i < kDivisions; ++i) sphere.divide();
  Mesh mesh = sphere.take();
  for (Vec3& position : mesh.positions) position = on_pumpkin(position);
  const Topology topology = build_topology(mesh);
  const Mesh noisy = add_noise(mesh, kSigma, kSeed, NoiseKind::kNormal);
  std::vector<Vec3> moves(mesh.positions.size());
  for (std::size_t v = 0; v < moves.size(); ++v) moves[v] = noisy.positions[v] - mesh.positions[v];
  moves = spread(moves, topology);
  for (std::size_t v = 0; v < moves.size(); ++v) mesh.positions[v] += moves[v];
  return mesh;
}

}  // namespace crease
