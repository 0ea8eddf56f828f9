#include "core/io/polygon.h"

#include <GL/glu.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "core/mesh/face_vectors.h"

namespace crease {
namespace {

/// Twice the vector area of the polygon, by the triangles of the fan, in units of its largest extent from the corner.
Vec3 scaled_area(const std::vector<Vec3>& positions, std::span<const Triangle> fan, double scale) {
  Vec3 sum = Vec3::Zero();
  for (const auto& [a, b, c] : fan) {
    sum += ((positions[b] - positions[a]) / scale).cross((positions[c] - positions[a]) / scale);
  }
  return sum;
}

double extent_from_first(const std::vector<Vec3>& positions, std::span<const Triangle> fan) {
  double extent = 0;
  for (const auto& [a, b, c] : fan) {
    extent = std::max({extent, (positions[b] - positions[a]).lpNorm<Eigen::Infinity>(),
                       (positions[c] - positions[a]).lpNorm<Eigen::Infinity>()});
  }
  return extent;
}

/// The tessellator of the OpenGL Utility Library. It needs no graphics context.
class PolygonTessellator {
 public:
  PolygonTessellator(const std::vector<Vec3>& positions, std::span<const Triangle> fan)
      : positions_(positions), tessellator_(gluNewTess(), gluDeleteTess) {
    corners_.push_back(fan.front()[0]);
    corners_.push_back(fan.front()[1]);
    for (const Triangle& triangle : fan) corners_.push_back(triangle[2]);
  }

  /// Returns the corners of the triangles; empty if it found none without new vertices.
  std::vector<Index> run(const Vec3& normal, double scale) {
    GLUtesselator* tessellator = tessellator_.get();
    if (tessellator == nullptr) return {};
    set_callbacks(tessellator);
    gluTessNormal(tessellator, normal.x(), normal.y(), normal.z());
    gluTessBeginPolygon(tessellator, this);
    gluTessBeginContour(tessellator);
    const Vec3 origin = positions_[corners_.front()];
    for (Index& corner : corners_) {
      Vec3 place = (positions_[corner] - origin) / scale;
      gluTessVertex(tessellator, place.data(), &corner);  // it copies the coordinates
    }
    gluTessEndContour(tessellator);
    gluTessEndPolygon(tessellator);
    return failed_ ? std::vector<Index>() : std::move(triangles_);
  }

 private:
  using Callback = void (*)();

  static void set_callbacks(GLUtesselator* tessellator) {
    gluTessCallback(tessellator, GLU_TESS_VERTEX_DATA, reinterpret_cast<Callback>(&on_vertex));
    // With this callback it makes separate triangles, no fans or strips.
    gluTessCallback(tessellator, GLU_TESS_EDGE_FLAG_DATA, reinterpret_cast<Callback>(&on_edge_flag));
    gluTessCallback(tessellator, GLU_TESS_COMBINE_DATA, reinterpret_cast<Callback>(&on_combine));
    gluTessCallback(tessellator, GLU_TESS_ERROR_DATA, reinterpret_cast<Callback>(&on_error));
  }

  static void on_vertex(void* vertex, void* self) {
    static_cast<PolygonTessellator*>(self)->triangles_.push_back(*static_cast<Index*>(vertex));
  }
  static void on_edge_flag(GLboolean /*flag*/, void* /*self*/) {}
  static void on_error(GLenum /*error*/, void* self) { static_cast<PolygonTessellator*>(self)->failed_ = true; }

  /// Corners at one place become one of them. Edges that cross would need a new vertex.
  static void on_combine(GLdouble* /*place*/, void** vertices, GLfloat* /*weights*/, void** out, void* self) {
    auto& tessellator = *static_cast<PolygonTessellator*>(self);
    *out = vertices[0];
    for (std::size_t k = 0; k < 4; ++k) {
      if (vertices[k] != nullptr && tessellator.place_of(vertices[k]) != tessellator.place_of(vertices[0])) {
        tessellator.failed_ = true;
      }
    }
  }

  const Vec3& place_of(const void* vertex) const { return positions_[*static_cast<const Index*>(vertex)]; }

  const std::vector<Vec3>& positions_;
  std::unique_ptr<GLUtesselator, void (*)(GLUtesselator*)> tessellator_;
  std::vector<Index> corners_;
  std::vector<Index> triangles_;
  bool failed_ = false;
};

/// Of the polygon's area, that a triangle has at least unless it counts as one without.
constexpr double kLeastShare = 1e-9;

/// Does away with triangles whose corner lies on their longest side: that corner divides the triangle on the other side
/// in two. Left out for want of area, they would leave a crack between it and the corner's other faces.
class CrackMender {
 public:
  CrackMender(const std::vector<Vec3>& positions, std::span<Triangle> tiles, const Vec3& area, double scale)
      : positions_(positions), tiles_(tiles), area_(area), scale_(scale) {
    for (std::size_t tile = 0; tile < tiles.size(); ++tile) note_sides(tile);
  }

  void run() {
    for (std::size_t tile = 0; tile < tiles_.size(); ++tile) waiting_.push_back(tile);
    while (!waiting_.empty()) {
      const std::size_t tile = waiting_.back();
      waiting_.pop_back();
      if (is_thin(tiles_[tile])) mend(tile);
    }
  }

 private:
  using Side = std::pair<Index, Index>;

  bool is_thin(const Triangle& tile) const {
    return scaled_area(positions_, {&tile, 1}, scale_).dot(area_) <= kLeastShare * area_.squaredNorm();
  }

  void note_sides(std::size_t tile) {
    for (std::size_t k = 0; k < 3; ++k) tile_at_[{tiles_[tile][k], tiles_[tile][(k + 1) % 3]}] = tile;
  }

  std::optional<std::size_t> across(const Side& side) const {
    const auto found = tile_at_.find({side.second, side.first});
    return found == tile_at_.end() ? std::nullopt : std::optional(found->second);
  }

  /// The triangle, turned so that its longest side is the first.
  Triangle longest_first(Triangle tile) const {
    std::array<double, 3> lengths{};
    for (std::size_t k = 0; k < 3; ++k) lengths[k] = (positions_[tile[(k + 1) % 3]] - positions_[tile[k]]).norm();
    std::rotate(tile.begin(), tile.begin() + (std::ranges::max_element(lengths) - lengths.begin()), tile.end());
    return tile;
  }

  void mend(std::size_t thin) {
    const auto [a, b, corner] = longest_first(tiles_[thin]);
    const std::optional<std::size_t> other = across({a, b});
    if (!other || *other == thin) return;
    const Triangle& divided = tiles_[*other];
    const auto apex = std::ranges::find_if(divided, [a = a, b = b](Index v) { return v != a && v != b; });
    if (apex == divided.end()) return;
    const Triangle left{corner, a, *apex}, right{*apex, b, corner};
    if (is_thin(left) || is_thin(right)) return;
    tiles_[thin] = left;
    tiles_[*other] = right;
    for (const std::size_t tile : {thin, *other}) {
      note_sides(tile);
      for (std::size_t k = 0; k < 3; ++k) {
        const auto next = across({tiles_[tile][k], tiles_[tile][(k + 1) % 3]});
        if (next) waiting_.push_back(*next);
      }
    }
  }

  const std::vector<Vec3>& positions_;
  std::span<Triangle> tiles_;
  const Vec3& area_;
  double scale_;
  std::map<Side, std::size_t> tile_at_;
  std::vector<std::size_t> waiting_;
};

}  // namespace

bool tile_polygon(const std::vector<Vec3>& positions, std::span<Triangle> fan) {
  const double scale = extent_from_first(positions, fan);
  if (!(scale > 0)) return false;
  const Vec3 area = scaled_area(positions, fan, scale);
  if (!(area.squaredNorm() > 0) || !area.allFinite()) return false;
  double least = std::numeric_limits<double>::infinity();
  for (const Triangle& triangle : fan) {
    least = std::min(least, scaled_area(positions, {&triangle, 1}, scale).dot(area) / area.squaredNorm());
  }
  if (least > kLeastShare) return true;
  // A corner that is named twice makes a triangle without area, and the rest may be tiled all the same.
  const bool fan_may_stay = least > -kLeastShare;
  if (fan.size() + 2 > kMostCornersToTile) return fan_may_stay;
  const std::vector<Index> corners = PolygonTessellator(positions, fan).run(area.normalized(), scale);
  if (corners.size() != 3 * fan.size()) return fan_may_stay;
  for (std::size_t i = 0; i < corners.size(); ++i) fan[i / 3][i % 3] = corners[i];
  CrackMender(positions, fan, area, scale).run();
  return true;
}

}  // namespace crease
