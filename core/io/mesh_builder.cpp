#include "core/io/mesh_builder.h"

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
  for (const Polygon& polygon : polygons_) {
    triangles += polygon.count;
    fans += tile_polygon(mesh_.positions, {mesh_.triangles.data() + polygon.first, polygon.count}) ? 0 : 1;
  }
  warn("polygons_triangulated", fmt::format("{} of more than 3 corners became {} triangles",
                                            counted(polygons_.size(), "face", "faces"), triangles));
  if (fans != 0) {
    warn("polygons_not_tiled", fmt::format("{} cannot be divided into triangles that do not overlap and became fans",
                                           counted(fans, "polygon", "polygons")));
  }
}

MeshContent MeshBuilder::finish() {
  tile_polygons();
  if (skipped_faces_ != 0) {
    warn("faces_skipped", fmt::format("skipped {} of fewer than 3 corners; the first is at {}",
                                      counted(skipped_faces_, "face", "faces"), first_skipped_));
  }
  if (!dropped_.empty()) {
    warn("attributes_dropped",
         fmt::format("only format=original keeps these of the file: {}", fmt::join(dropped_, ", ")));
  }
  std::vector<double> final_weights = std::move(weights());
  return {std::move(mesh_), std::move(final_weights), std::move(warnings_)};
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
