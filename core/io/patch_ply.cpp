#include <algorithm>
#include <array>
#include <limits>

#include "core/io/corner_normals.h"
#include "core/io/ply.h"
#include "core/io/ply_body.h"
#include "core/io/text_patch.h"
#include "core/io/write_number.h"

namespace crease {
namespace {

/// A text body whose numbers can be replaced.
class PlyAsciiPatch : public PlyAsciiBody {
 public:
  using Reader = PlyAsciiBody;

  PlyAsciiPatch(std::string_view upload, TextCursor cursor) : PlyAsciiBody(cursor), patch_(upload) {}

  void replace(PlyType /*type*/, double value) {
    cursor_.skip_to_word();
    patch_.replace(cursor_.word(), value);
  }
  std::string finish() { return patch_.finish(); }

 private:
  TextPatch patch_;
};

/// A binary body whose numbers can be replaced.
class PlyBinaryPatch : public PlyBinaryBody {
 public:
  using Reader = PlyBinaryBody;

  PlyBinaryPatch(std::string_view upload, std::size_t offset, bool big_endian)
      : PlyBinaryBody(upload, offset, big_endian), bytes_(upload) {}

  /// \throw Error mesh_unsupported
  void replace(PlyType type, double value) {
    if (type == PlyType::kFloat64) return overwrite(value);
    if (!(std::abs(value) <= static_cast<double>(std::numeric_limits<float>::max()))) {
      throw Error(code::kMeshUnsupported, fmt::format("{} does not fit into the single precision of the file", value),
                  place());
    }
    overwrite(static_cast<float>(value));
  }
  std::string finish() { return std::move(bytes_); }

 private:
  template <typename Number>
  void overwrite(Number value) {
    auto raw = std::bit_cast<std::array<char, sizeof(Number)>>(value);
    if (cursor_.big_endian() != (std::endian::native == std::endian::big)) std::ranges::reverse(raw);
    std::ranges::copy(raw, bytes_.begin() + static_cast<std::ptrdiff_t>(cursor_.offset()));
    cursor_.take(raw.size());
  }

  std::string bytes_;
};

bool is_floating(PlyType type) { return type == PlyType::kFloat32 || type == PlyType::kFloat64; }

template <typename Body>
class PlyPatcher {
 public:
  PlyPatcher(Body body, const PlyHeader& header, const LabelledMesh& result)
      : body_(std::move(body)), header_(header), result_(result) {}

  std::string write() {
    const bool has_strips =
        std::ranges::any_of(header_.elements, [](const PlyElement& element) { return element.name == "tristrips"; });
    for (const PlyElement& element : header_.elements) {
      if (element.name == "vertex") {
        write_vertices(element);
      } else if (element.name == "face" && has_normals(element) && !has_strips) {
        write_faces(element);
      } else {
        for (std::size_t i = 0; i < element.count && !element.properties.empty(); ++i) write_element(element, {}, {});
      }
    }
    return body_.finish();
  }

 private:
  static bool is_named(const PlyProperty& property, std::array<std::string_view, 3> names) {
    return !property.count_type && std::ranges::find(names, property.name) != names.end();
  }
  static bool is_position(const PlyProperty& property) { return is_named(property, {"x", "y", "z"}); }
  static bool is_normal(const PlyProperty& property) {
    return is_named(property, {"nx", "ny", "nz"}) && is_floating(property.type);
  }
  static bool has_normals(const PlyElement& element) {
    return std::ranges::count_if(element.properties, is_normal) == 3;
  }

  static void require_floating_positions(const PlyElement& element) {
    const bool floating = std::ranges::all_of(element.properties, [](const PlyProperty& property) {
      return !is_position(property) || is_floating(property.type);
    });
    if (floating) return;
    throw Error(code::kMeshUnsupported,
                "the coordinates of the original file are integers, which cannot hold the result; format=ply can",
                element.place);
  }

  /// Writes the next element; `position` and `normal` where it has them. Returns the number of its corners.
  std::size_t write_element(const PlyElement& element, const std::optional<Vec3>& position,
                            const std::optional<Vec3>& normal) {
    std::size_t corners = 0;
    body_.begin_element();
    for (const PlyProperty& property : element.properties) {
      const std::size_t count = property.count_type ? body_.length(*property.count_type) : 1;
      if (is_corner_list(property)) corners = count;
      const std::optional<Vec3>& vector = is_position(property) ? position : normal;
      const bool replaces = vector && (is_position(property) || is_normal(property));
      if (replaces) {
        body_.replace(property.type, (*vector)[property.name.back() - 'x']);
      } else {
        body_.skip(property.type, count);
      }
    }
    body_.end_element();
    return corners;
  }

  void write_vertices(const PlyElement& element) {
    require_vertices(element.count, result_.mesh);
    require_floating_positions(element);
    std::optional<NormalMeans> normals;
    if (has_normals(element)) {
      normals.emplace(result_, element.count);
      normals->add_vertices();
    }
    for (std::size_t i = 0; i < element.count; ++i) {
      write_element(element, result_.mesh.positions[i], normals ? (*normals)[i] : std::nullopt);
    }
  }

  /// The corners of a face may follow its normal, so they are counted ahead.
  void write_faces(const PlyElement& element) {
    std::size_t first = 0;
    for (std::size_t i = 0; i < element.count; ++i) {
      const std::size_t corners = corners_ahead(element);
      const std::size_t triangles = corners < 3 ? 0 : corners - 2;
      if (triangles > result_.mesh.triangles.size() - first) {
        throw Error(code::kMeshCountMismatch, "the original file has more faces than the result", element.place);
      }
      write_element(element, {}, face_normal(result_.mesh, first, triangles));
      first += triangles;
    }
  }

  std::size_t corners_ahead(const PlyElement& element) const {
    typename Body::Reader ahead(body_);
    ahead.begin_element();
    for (const PlyProperty& property : element.properties) {
      const std::size_t count = property.count_type ? ahead.length(*property.count_type) : 1;
      if (is_corner_list(property)) return count;
      ahead.skip(property.type, count);
    }
    return 0;
  }

  Body body_;
  const PlyHeader& header_;
  const LabelledMesh& result_;
};

}  // namespace

std::string patch_ply(std::string_view upload, const LabelledMesh& result) {
  TextCursor cursor(upload, {});
  const PlyHeader header = read_ply_header(upload, cursor);
  if (header.encoding == PlyEncoding::kAscii) return PlyPatcher(PlyAsciiPatch(upload, cursor), header, result).write();
  const bool big_endian = header.encoding == PlyEncoding::kBigEndian;
  return PlyPatcher(PlyBinaryPatch(upload, header.binary_start, big_endian), header, result).write();
}

}  // namespace crease
