#include "core/io/stl.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "core/base/text.h"
#include "core/io/byte_cursor.h"
#include "core/io/corner_normals.h"
#include "core/io/mesh_builder.h"
#include "core/io/stl_text.h"
#include "core/io/text_patch.h"
#include "core/io/write_number.h"
#include "core/mesh/position_index.h"

namespace crease {
namespace {

constexpr std::size_t kHeaderBytes = 80;
constexpr std::size_t kCountEnd = kHeaderBytes + 4;
constexpr std::size_t kFacetBytes = 50;
constexpr std::size_t kNormalBytes = 12;

/// Builds a mesh with shared vertices from facets.
class StlBuilder {
 public:
  explicit StlBuilder(const DecodeLimits& limits) : builder(limits) {}

  template <typename Place>
  Index corner(const Vec3& position, Place&& place) {
    ++corners_;
    if (!position.allFinite()) builder.add_vertex(position.x(), position.y(), position.z(), place);
    const Index vertex = lookup_.find_or_append(builder.mesh().positions, position);
    if (builder.vertices() > builder.limits().max_vertices) {
      MeshBuilder::fail_too_large("vertices", builder.limits().max_vertices, place());
    }
    return vertex;
  }

  MeshContent finish() {
    if (corners_ != builder.vertices()) {
      builder.warn("stl_vertices_welded", fmt::format("welded {} facet corners with exactly equal positions to {}",
                                                      corners_, counted(builder.vertices(), "vertex", "vertices")));
    }
    return builder.finish();
  }

  MeshBuilder builder;

 private:
  PositionIndex lookup_;
  std::size_t corners_ = 0;
};

std::uint64_t counted_facets_of(std::string_view bytes) {
  return load<std::uint32_t>(bytes.data() + kHeaderBytes, false);
}

/// Whether bytes are whole facets, each with a normal of length 1 or none. Other data has hardly ever such numbers.
bool are_facets(std::string_view bytes) {
  if (bytes.empty() || bytes.size() % kFacetBytes != 0 || bytes.find_first_not_of('\0') == bytes.npos) return false;
  for (ByteCursor cursor(bytes); cursor.rest() != 0; cursor.take(kFacetBytes - kNormalBytes)) {
    Vec3 normal;
    for (double& coordinate : normal) coordinate = static_cast<double>(cursor.read<float>());
    constexpr double kRounding = 0.01;
    if (!(normal.isZero(0) || std::abs(normal.norm() - 1) < kRounding)) return false;
  }
  return true;
}

/// The number of facets: the one in the header, or what the bytes hold where it is 0 or facets stand behind it, as of
/// writers that never came back to it.
std::size_t facets_in(std::string_view bytes) {
  const std::size_t counted_facets = counted_facets_of(bytes), held = (bytes.size() - kCountEnd) / kFacetBytes;
  if (counted_facets == 0) return held;
  if (counted_facets >= held) return counted_facets;
  return are_facets(bytes.substr(kCountEnd + counted_facets * kFacetBytes)) ? held : counted_facets;
}

std::size_t read_facet_count(std::string_view bytes, ByteCursor& cursor, StlBuilder& stl) {
  const std::string place = cursor.place();
  const std::size_t counted_facets = cursor.read<std::uint32_t>();
  const std::size_t held = cursor.rest() / kFacetBytes;
  if (counted_facets > held) {
    throw Error(code::kMeshTruncated,
                fmt::format("the header announces {} facets, but the {} bytes after it hold only {}", counted_facets,
                            cursor.rest(), held),
                place);
  }
  const std::size_t facets = facets_in(bytes);
  if (facets != counted_facets) {
    stl.builder.warn("facet_count_replaced", fmt::format("the header announces {}; read the {} that the file holds",
                                                         counted(counted_facets, "facet", "facets"), facets));
  }
  const std::size_t limit = stl.builder.limits().max_faces;
  if (facets > limit) MeshBuilder::fail_too_large("faces", limit, place);
  return facets;
}

MeshContent read_binary(std::string_view bytes, const DecodeLimits& limits) {
  StlBuilder stl(limits);
  ByteCursor cursor(bytes);
  cursor.take(kHeaderBytes);
  const std::size_t facets = read_facet_count(bytes, cursor, stl);
  stl.builder.mesh().triangles.reserve(facets);
  bool has_attributes = false;
  for (std::size_t i = 0; i < facets; ++i) {
    cursor.take(kNormalBytes);
    Triangle corners{};
    for (Index& corner : corners) {
      const std::size_t offset = cursor.offset();
      const float x = cursor.read<float>();
      const float y = cursor.read<float>();
      const float z = cursor.read<float>();
      corner = stl.corner(Vec3(x, y, z), [&] { return fmt::format("byte {}", offset); });
    }
    has_attributes = cursor.read<std::uint16_t>() != 0 || has_attributes;
    stl.builder.add_face(corners, [&] { return cursor.place(); });
  }
  if (has_attributes) stl.builder.drop("attribute bytes");
  if (cursor.rest() != 0) {
    stl.builder.warn("trailing_bytes", fmt::format("ignored {} after the last facet, from {}",
                                                   counted(cursor.rest(), "byte", "bytes"), cursor.place()));
  }
  return stl.finish();
}

MeshContent read_ascii(std::string_view bytes, const DecodeLimits& limits) {
  StlBuilder stl(limits);
  StlText text(bytes);
  StlFacet facet;
  std::vector<Index> corners;
  while (text.next(facet)) {
    corners.clear();
    for (const StlFacet::Corner& corner : facet.corners) {
      corners.push_back(stl.corner(corner.position, [&] { return fmt::format("line {}", corner.line); }));
    }
    stl.builder.add_face(corners, [&] { return fmt::format("line {}", facet.line); });
  }
  if (text.solids() > 1) stl.builder.drop("solids and their names");
  if (text.is_in_solid()) {
    stl.builder.warn("endsolid_missing",
                     "the file ends without 'endsolid' behind a whole facet; it may have been cut off");
  }
  if (text.skipped_lines() != 0) {
    stl.builder.warn("text_skipped", fmt::format("skipped text that is no part of a facet on {}; the first is {}",
                                                 counted(text.skipped_lines(), "line", "lines"), text.first_skipped()));
  }
  return stl.finish();
}

/// Finds the vertices of a result by the positions of an upload's corners, which come in the order of the file.
class StlCorners {
 public:
  explicit StlCorners(const Mesh& result) : result_(result) {}

  const Vec3& moved(const Vec3& position) {
    const Index vertex = lookup_.find_or_append(positions_, position);
    if (vertex >= result_.positions.size()) require_vertices(vertex + 1, result_);
    return result_.positions[vertex];
  }
  /// The normal of the next facet.
  std::optional<Vec3> next_normal(std::size_t corners) {
    if (corners < 3) return std::nullopt;
    const std::size_t first = face_;
    face_ += corners - 2;
    if (face_ > result_.triangles.size()) {
      throw Error(code::kMeshCountMismatch, "the original file has more facets than the result");
    }
    return face_normal(result_, first, corners - 2);
  }

  /// Checks that the file had all of the result.
  void finish() const {
    require_vertices(positions_.size(), result_);
    if (face_ == result_.triangles.size()) return;
    throw Error(code::kMeshCountMismatch, "the original file has fewer facets than the result");
  }

 private:
  const Mesh& result_;
  PositionIndex lookup_;
  std::vector<Vec3> positions_;
  std::size_t face_ = 0;
};

/// Whether the words of a normal are one that is not zero.
bool is_normal(const std::vector<std::string_view>& words) {
  return words.size() == 3 && std::ranges::any_of(words, [](std::string_view word) {
           return word.find_first_of("123456789") < std::min(word.find_first_of("eE"), word.size());
         });
}

std::string patch_ascii(std::string_view upload, const Mesh& result) {
  StlText text(upload);
  TextPatch patch(upload);
  StlCorners corners(result);
  StlFacet facet;
  std::vector<Vec3> moved;
  while (text.next(facet)) {
    moved.clear();
    for (const StlFacet::Corner& corner : facet.corners) moved.push_back(corners.moved(corner.position));
    const std::optional<Vec3> normal = corners.next_normal(moved.size());
    const bool has_normal = normal && is_normal(facet.normal);
    for (std::size_t k = 0; k < 3 && has_normal; ++k) patch.replace(facet.normal[k], (*normal)[Eigen::Index(k)]);
    for (std::size_t i = 0; i < moved.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k) patch.replace(facet.corners[i].words[k], moved[i][Eigen::Index(k)]);
    }
  }
  corners.finish();
  return patch.finish();
}

/// Overwrites three floats of `bytes`.
void overwrite_floats(std::string& bytes, std::size_t offset, const std::array<float, 3>& values) {
  std::string raw;
  for (const float value : values) append_little_endian(raw, value);
  bytes.replace(offset, raw.size(), raw);
}

std::string patch_binary(std::string_view upload, const Mesh& result) {
  std::string bytes(upload);
  StlCorners corners(result);
  const std::size_t facets = facets_in(upload);
  ByteCursor cursor(upload, kCountEnd);
  for (std::size_t facet = 0; facet < facets; ++facet) {
    const std::size_t start = cursor.offset();
    Vec3 old_normal;
    for (double& coordinate : old_normal) coordinate = static_cast<double>(cursor.read<float>());
    for (std::size_t k = 0; k < 3; ++k) {
      Vec3 position;
      const std::size_t offset = cursor.offset();
      for (double& coordinate : position) coordinate = static_cast<double>(cursor.read<float>());
      overwrite_floats(bytes, offset, to_single(corners.moved(position), 3 * facet + k));
    }
    const std::optional<Vec3> normal = corners.next_normal(3);
    if (normal && !old_normal.isZero(0)) overwrite_floats(bytes, start, to_single(*normal, facet));
    cursor.take(2);
  }
  corners.finish();
  return bytes;
}

bool is_exactly_binary(std::string_view bytes) {
  if (bytes.size() <= kCountEnd) return false;
  const std::uint64_t facets = counted_facets_of(bytes);
  return facets != 0 && kCountEnd + facets * kFacetBytes == bytes.size();
}

bool has_binary_head(std::string_view bytes) { return bytes.substr(0, kCountEnd).find('\0') != std::string_view::npos; }

bool may_be_binary(std::string_view bytes) {
  if (bytes.size() <= kCountEnd || !has_binary_head(bytes)) return false;
  const std::uint64_t facets = counted_facets_of(bytes);
  const std::uint64_t room = bytes.size() - kCountEnd;
  // The bytes of all zeros are no mesh.
  const bool is_uncounted = facets == 0 && room % kFacetBytes == 0 && bytes.find_first_not_of('\0') != bytes.npos;
  return is_uncounted || (facets != 0 && facets <= room / kFacetBytes);
}

/// A binary file may begin with "solid" as well. Then its size fits its count, or its header has a NUL byte.
bool is_ascii(std::string_view bytes) {
  return !is_exactly_binary(bytes) && !has_binary_head(bytes) && is_stl_text(bytes);
}

}  // namespace

Likeness looks_like_stl(const Sample& sample) {
  if (is_exactly_binary(sample.bytes)) return Likeness::kCertain;
  const bool is_solid = equals_ignoring_case(sample.word.substr(0, 5), "solid");
  if (is_solid || may_be_binary(sample.bytes)) return Likeness::kHead;
  // Other text may come first.
  constexpr std::size_t kFirst = 4096;
  const std::string_view first = sample.text.substr(0, kFirst);
  return !has_binary_head(sample.bytes) && is_stl_text(first) ? Likeness::kText : Likeness::kUnlike;
}

MeshContent read_stl(std::string_view bytes, const DecodeLimits& limits) {
  return is_ascii(bytes) ? read_ascii(bytes, limits) : read_binary(bytes, limits);
}

std::string patch_stl(std::string_view upload, const LabelledMesh& result) {
  return is_ascii(upload) ? patch_ascii(upload, result.mesh) : patch_binary(upload, result.mesh);
}

std::string write_stl(const LabelledMesh& result, const nlohmann::ordered_json& /*extras*/,
                      const MeshStyle& /*style*/) {
  const Mesh& mesh = result.mesh;
  std::string bytes = "binary STL written by creased";
  bytes.resize(80, ' ');
  bytes.reserve(84 + 50 * mesh.triangles.size());
  append_little_endian(bytes, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const Triangle& triangle : mesh.triangles) {
    const auto& [a, b, c] = triangle;
    const Vec3 ab = mesh.positions[b] - mesh.positions[a], ac = mesh.positions[c] - mesh.positions[a];
    const Vec3 normal = ab.stableNormalized().cross(ac.stableNormalized()).stableNormalized();
    for (const double coordinate : normal) append_little_endian(bytes, static_cast<float>(coordinate));
    for (const Index corner : triangle) {
      for (const float coordinate : to_single(mesh.positions[corner], corner)) append_little_endian(bytes, coordinate);
    }
    append_little_endian(bytes, std::uint16_t{0});
  }
  return bytes;
}

}  // namespace crease
