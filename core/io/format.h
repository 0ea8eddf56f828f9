#pragma once

#include <array>
#include <cstddef>
#include <initializer_list>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/io/appearance.h"
#include "core/io/labelled_mesh.h"
#include "core/mesh/mesh.h"

namespace crease {

/// Limits that are checked before memory is reserved for the counts in a header.
struct DecodeLimits {
  std::size_t max_vertices = 20'000'000;
  std::size_t max_faces = 20'000'000;
};

/// What a reader finds in a mesh file.
struct MeshContent {
  Mesh mesh;
  /// Weights of the likelihood, one per vertex; empty if the file has none. They come from PLY's vertex property
  /// `weight` or glTF's attribute `_WEIGHT` (primitives without the attribute count as 1).
  std::vector<double> weights;
  Appearance appearance;
  /// Codes: polygons_triangulated, polygons_not_tiled, faces_skipped, vertices_welded, stl_vertices_welded,
  /// facet_count_replaced, endsolid_missing, fourth_coordinates_ignored, source_ignored, weights_unusual,
  /// trailing_bytes, text_skipped, elements_skipped, statements_skipped, primitives_skipped, attributes_dropped. Each
  /// cause is reported once, with a count.
  std::vector<Warning> warnings;
};

/// How a mesh is written where its format leaves a choice.
struct MeshStyle {
  bool ridge_lines = false;  ///< the ridges as lines, in OBJ
  bool compressed = false;   ///< by meshoptimizer, in glTF
  bool quantized = false;    ///< positions, normals and colours as small whole numbers, in glTF
};

/// The beginning of a file as the sniffing functions see it.
struct Sample {
  explicit Sample(std::string_view file);

  std::string_view bytes;  ///< the whole file
  std::string_view text;   ///< the file without a UTF-8 byte order mark
  std::string_view word;   ///< the first word of the text that is not in a '#' comment
};

/// How strongly the bytes of a file suggest a format.
enum class Likeness {
  kUnlike,
  kText,     ///< the first word fits
  kHead,     ///< the fixed part of a binary file, or its keyword, fits
  kMagic,    ///< the magic number is at the very beginning
  kCertain,  ///< chance is ruled out
};

/// Up to eight names. The first is the preferred one.
class Names {
 public:
  constexpr Names(std::initializer_list<std::string_view> names) : count_(names.size()) {
    std::size_t i = 0;
    for (const std::string_view name : names) names_.at(i++) = name;
  }

  constexpr const std::string_view* begin() const { return names_.data(); }
  constexpr const std::string_view* end() const { return names_.data() + count_; }
  constexpr std::string_view front() const { return names_.front(); }

 private:
  std::array<std::string_view, 8> names_{};
  std::size_t count_;
};

/// A file format: a row of the table in core/io/formats.h. Operations that the format does not support are null.
struct Format {
  std::string_view name;   ///< the value of `format=` and `--format`
  std::string_view title;  ///< for sentences
  Names media_types;       ///< files are served under the first; all are accepted
  Names extensions;        ///< in lower case, without the dot
  bool is_text = false;    ///< suits a terminal
  /// The start of a file is free text and may look like any other format.
  bool has_free_head = false;
  bool has_ridge_lines = false;  ///< MeshStyle::ridge_lines has an effect
  bool has_compression = false;  ///< MeshStyle::compressed and quantized have an effect
  Names keeps{};  ///< what the writer takes over from uploads in any format, by the names of attributes_of

  Likeness (*looks_like)(const Sample& sample) = nullptr;

  /// Reads untrusted bytes within the limits. The mesh may have no faces. \throw Error mesh_*, weights_invalid
  MeshContent (*read)(std::string_view bytes, const DecodeLimits& limits) = nullptr;

  /// Writes the mesh, and whatever else of the result the format can hold. \throw Error mesh_unsupported, mesh_no_faces
  std::string (*write)(const LabelledMesh& result, const nlohmann::ordered_json& extras,
                       const MeshStyle& style) = nullptr;

  /// Writes the upload again, with the positions of the result; normals, where the upload has them, are recomputed. All
  /// else stays. `upload` must be what `read` made the mesh of. \throw Error mesh_unsupported, mesh_count_mismatch
  std::string (*patch)(std::string_view upload, const LabelledMesh& result) = nullptr;

  /// Writes the edges whose label is at least `min_label`.
  std::string (*write_labels)(const LabelledMesh& result, double min_label) = nullptr;

  /// Writes the ridge lines. \throw Error mesh_unsupported
  std::string (*write_ridges)(const LabelledMesh& result, const nlohmann::ordered_json& extras) = nullptr;
};

}  // namespace crease
