#include "tests/support/patch_builder.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace crease::test {

Index PatchBuilder::vertex(const Vec3& point) {
  const std::array<long long, 3> key = {std::llround(point.x() * 1e7), std::llround(point.y() * 1e7),
                                        std::llround(point.z() * 1e7)};
  const auto [found, added] = vertices_.try_emplace(key, static_cast<Index>(mesh_.positions.size()));
  if (added) mesh_.positions.push_back(point);
  return found->second;
}

void PatchBuilder::triangle(Index a, Index b, Index c) {
  mesh_.triangles.push_back({a, b, c});
  surfaces_.push_back(surface_);
}

void PatchBuilder::patch(int columns, int rows, const std::function<Vec3(int, int)>& point) {
  for (int v = 0; v < rows; ++v) {
    for (int u = 0; u < columns; ++u) {
      const Index a = vertex(point(u, v)), b = vertex(point(u + 1, v));
      const Index c = vertex(point(u + 1, v + 1)), d = vertex(point(u, v + 1));
      if ((u + v) % 2 == 0) {
        triangle(a, b, c);
        triangle(a, c, d);
      } else {
        triangle(a, b, d);
        triangle(b, c, d);
      }
    }
  }
}

void PatchBuilder::disc(const Vec3& centre, double radius, int around, bool up) {
  disc(around, up, [&](const Vec3& point) -> Vec3 { return centre + radius * point; });
}

void PatchBuilder::disc(int around, bool up, const std::function<Vec3(const Vec3&)>& place) {
  const int rings = std::max(1, static_cast<int>(std::lround(around / (2 * M_PI))));
  std::vector<Index> inner = {vertex(place(Vec3::Zero()))};
  for (int ring = 1; ring <= rings; ++ring) {
    const int count = ring == rings ? around : std::max(3, around * ring / rings);
    const double share = static_cast<double>(ring) / rings;
    std::vector<Index> outer;
    for (int i = 0; i < count; ++i) outer.push_back(vertex(place(on_circle(Vec3::Zero(), share, i, count))));
    stitch(inner, outer, up);
    inner = std::move(outer);
  }
}

Vec3 PatchBuilder::on_circle(const Vec3& centre, double radius, int i, int count) {
  const double angle = 2 * M_PI * (i % count) / count;
  return centre + radius * Vec3(std::cos(angle), std::sin(angle), 0);
}

std::vector<Edge> PatchBuilder::surface_borders() const {
  std::map<std::pair<Index, Index>, int> first_surface;
  std::vector<Edge> borders;
  for (std::size_t face = 0; face < mesh_.triangles.size(); ++face) {
    const Triangle& corners = mesh_.triangles[face];
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [v0, v1] = std::minmax(corners[k], corners[(k + 1) % 3]);
      const auto [found, added] = first_surface.try_emplace({v0, v1}, surfaces_[face]);
      if (!added && found->second != surfaces_[face]) borders.push_back({v0, v1});
    }
  }
  std::sort(borders.begin(), borders.end(),
            [](const Edge& a, const Edge& b) { return std::tie(a.v0, a.v1) < std::tie(b.v0, b.v1); });
  return borders;
}

void PatchBuilder::stitch(const std::vector<Index>& inner, const std::vector<Index>& outer, bool up) {
  const std::size_t inner_steps = inner.size() == 1 ? 0 : inner.size();
  std::size_t i = 0, j = 0;
  while (i < inner_steps || j < outer.size()) {
    const bool step_outer = i == inner_steps || (j < outer.size() && (j + 1) * inner_steps <= (i + 1) * outer.size());
    const Index a = inner[i % inner.size()], b = outer[j % outer.size()];
    const Index c = step_outer ? outer[++j % outer.size()] : inner[++i % inner.size()];
    if (up) {
      triangle(a, b, c);
    } else {
      triangle(b, a, c);
    }
  }
}

}  // namespace crease::test
