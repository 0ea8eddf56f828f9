#include "core/io/mesh_builder.h"

#include "core/io/dropped_attributes.h"
#include "core/io/polygon.h"

namespace crease {
namespace {

void check_promise(std::string_view what, std::size_t count, std::size_t limit, std::size_t least_bytes_each,
                   std::size_t bytes_left, const std::string& place) {
  if (count > limit) MeshBuilder::fail_too_large(what, limit, place);
  if (count > bytes_left / least_bytes_each) {
    throw Error(
        code::kMeshTruncated,
        fmt::format("the header announces {} {}, but the remaining {} bytes cannot hold them", count, what, bytes_left),
        place);
  }
}

}  // namespace

void MeshBuilder::expect_vertices(std::size_t count, std::size_t least_bytes_each, std::size_t bytes_left,
                                  const std::string& place) {
  check_promise("vertices", count, limits_.max_vertices, least_bytes_each, bytes_left, place);
  mesh_.positions.reserve(count);
}

void MeshBuilder::expect_faces(std::size_t count, std::size_t least_bytes_each, std::size_t bytes_left,
                               const std::string& place) {
  check_promise("faces", count, limits_.max_faces, least_bytes_each, bytes_left, place);
  mesh_.triangles.reserve(count);
}

void MeshBuilder::tile_polygons() {
  if (polygons_.empty()) return;
  std::size_t triangles = 0, fans = 0;
  std::vector<Triangle> fan;
  for (const Polygon& polygon : polygons_) {
    const std::span<Triangle> tiles(mesh_.triangles.data() + polygon.first, polygon.count);
    if (!appearance_.texture.empty()) fan.assign(tiles.begin(), tiles.end());
    triangles += polygon.count;
    fans += tile_polygon(mesh_.positions, tiles) ? 0 : 1;
    if (!appearance_.texture.empty()) move_texture(polygon.first, fan);
  }
  warn("polygons_triangulated", fmt::format("{} of more than 3 corners became {} triangles",
                                            counted(polygons_.size(), "face", "faces"), triangles));
  if (fans != 0) {
    warn("polygons_not_tiled", fmt::format("{} cannot be divided into triangles that do not overlap and became fans",
                                           counted(fans, "polygon", "polygons")));
  }
}

void MeshBuilder::add_texture(std::span<const Index> numbers) {
  if (numbers.size() < 3) return;
  if (appearance_.texture.empty()) appearance_.texture.emplace_back();
  std::vector<Triangle>& corners = appearance_.texture.front().corners;
  corners.resize(mesh_.triangles.size() - (numbers.size() - 2), {kNone, kNone, kNone});
  for (std::size_t k = 2; k < numbers.size(); ++k) corners.push_back({numbers[0], numbers[k - 1], numbers[k]});
}

/// Texture coordinates follow the corners of a polygon from its fan to the triangles that tile it.
void MeshBuilder::move_texture(std::size_t first, std::span<const Triangle> fan) {
  std::vector<Triangle>& corners = appearance_.texture.front().corners;
  if (corners.size() < first + fan.size()) return;
  if (std::ranges::equal(fan, std::span(mesh_.triangles).subspan(first, fan.size()))) return;
  std::vector<std::pair<Index, Index>> number_of;
  for (std::size_t i = 0; i < fan.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) number_of.emplace_back(fan[i][k], corners[first + i][k]);
  }
  std::ranges::stable_sort(number_of, {}, &std::pair<Index, Index>::first);
  for (std::size_t i = first; i < first + fan.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Index vertex = mesh_.triangles[i][k];
      corners[i][k] = std::ranges::lower_bound(number_of, vertex, {}, &std::pair<Index, Index>::first)->second;
    }
  }
}

void MeshBuilder::start_material(Index material) {
  std::vector<MaterialRun>& runs = appearance_.material_runs;
  const auto next = static_cast<Index>(mesh_.triangles.size());
  if (!runs.empty() && runs.back().first_face == next) runs.pop_back();
  const Index current = runs.empty() ? kNone : runs.back().material;
  if (material != current) runs.push_back({next, material});
}

/// Brings what was read to the length of the mesh.
void MeshBuilder::settle_appearance() {
  for (CornerValues<2>& set : appearance_.texture) {
    for (auto& [u, v] : set.values) {
      if (std::isfinite(u) && std::isfinite(v)) continue;
      u = v = 0;
      drop("texture coordinates that are no finite numbers");
    }
  }
  for (CornerValues<2>& set : appearance_.texture) {
    if (!set.corners.empty()) set.corners.resize(mesh_.triangles.size(), {kNone, kNone, kNone});
  }
  if (std::vector<Colour>& colours = appearance_.face_colours;
      !colours.empty() && colours.size() != mesh_.triangles.size()) {
    colours.clear();
    drop("face colours of some faces");
  }
  if (!appearance_.material_runs.empty() && appearance_.material_runs.back().first_face >= mesh_.triangles.size()) {
    appearance_.material_runs.pop_back();
  }
}

MeshContent MeshBuilder::finish() {
  tile_polygons();
  settle_appearance();
  if (skipped_faces_ != 0) {
    warn("faces_skipped", fmt::format("skipped {} of fewer than 3 corners; the first is at {}",
                                      counted(skipped_faces_, "face", "faces"), first_skipped_));
  }
  const std::vector<std::string> attributes = attributes_of(appearance_, mesh_.triangles);
  if (!attributes.empty()) warn(kAttributesDropped, describe_dropped(attributes));
  std::vector<double> final_weights = std::move(weights());
  return {std::move(mesh_), std::move(final_weights), std::move(appearance_), std::move(warnings_)};
}

void MeshBuilder::fail_too_large(std::string_view what, std::size_t limit, const std::string& place) {
  throw Error(code::kMeshTooLarge, fmt::format("more than {} {}", limit, what), place);
}

void MeshBuilder::fail_not_finite(const std::string& place) {
  throw Error(code::kMeshNotFinite, "a vertex has a coordinate that is not a finite number", place);
}

void MeshBuilder::fail_index(std::int64_t index, std::size_t count) const {
  throw Error(code::kMeshIndexOutOfRange,
              fmt::format("a face uses vertex {} (counted from 0), but the file has {}", index,
                          counted(count, "vertex", "vertices")),
              face_place());
}

std::string counted(std::size_t count, std::string_view singular, std::string_view plural) {
  return fmt::format("{} {}", count, count == 1 ? singular : plural);
}

}  // namespace crease
