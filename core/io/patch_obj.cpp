#include <charconv>

#include "core/error.h"
#include "core/io/corner_normals.h"
#include "core/io/obj.h"
#include "core/io/text_patch.h"

namespace crease {
namespace {

constexpr TextCursor::Style kObjStyle{.comment = '#', .backslash = true};

std::size_t count_normals(std::string_view text) {
  TextCursor cursor(text, kObjStyle);
  std::size_t count = 0;
  for (; cursor.skip_to_word(); cursor.skip_line()) count += cursor.word() == "vn" ? 1 : 0;
  return count;
}

/// Finds the corners that name each normal of a file.
class ObjNormals {
 public:
  ObjNormals(std::string_view text, const LabelledMesh& result, std::size_t count)
      : cursor_(text, kObjStyle), mesh_(result.mesh), means_(result, count), count_(static_cast<std::int64_t>(count)) {
    normal_of_.resize(mesh_.positions.size(), -1);
  }

  NormalMeans read() {
    for (; cursor_.skip_to_word(); cursor_.skip_line()) {
      const std::string_view keyword = cursor_.word();
      if (keyword == "v") ++vertices_;
      if (keyword == "vn") ++normals_;
      if (keyword == "f") read_face();
    }
    return std::move(means_);
  }

 private:
  void read_face() {
    std::size_t corners = 0;
    for (; !cursor_.at_line_end(); ++corners) read_corner(cursor_.word());
    const std::size_t end = corners < 3 ? face_ : std::min(face_ + corners - 2, mesh_.triangles.size());
    for (; face_ < end; ++face_) {
      for (std::size_t place = 0; place < 3; ++place) {
        const std::int64_t normal = normal_of_[mesh_.triangles[face_][place]];
        if (normal >= 0) means_.add(static_cast<std::size_t>(normal), face_, place);
      }
    }
  }

  /// Remembers which normal goes with the vertex of the corner in this face.
  void read_corner(std::string_view word) {
    const std::int64_t vertex = index_from(word, vertices_);
    const std::size_t slash = word.find('/', word.find('/') + 1);
    const std::int64_t normal =
        word.find('/') == slash || slash == std::string_view::npos ? -1 : index_from(word.substr(slash + 1), normals_);
    if (vertex < 0 || vertex >= static_cast<std::int64_t>(normal_of_.size())) return;
    normal_of_[static_cast<std::size_t>(vertex)] = normal < count_ ? normal : -1;
  }

  /// The index at the start of the text, counted from 0; −1 for none. Negative ones count backwards.
  static std::int64_t index_from(std::string_view text, std::int64_t so_far) {
    std::int64_t index = 0;
    std::from_chars(text.data(), text.data() + text.size(), index);
    return index < 0 ? std::max(so_far + index, std::int64_t{-1}) : index - 1;
  }

  TextCursor cursor_;
  const Mesh& mesh_;
  NormalMeans means_;
  std::int64_t count_;
  std::int64_t vertices_ = 0, normals_ = 0;  ///< so far
  std::size_t face_ = 0;
  std::vector<std::int64_t> normal_of_;  ///< per vertex, in the current face
};

}  // namespace

std::string patch_obj(std::string_view upload, const LabelledMesh& result) {
  std::optional<NormalMeans> means;
  if (const std::size_t count = count_normals(upload); count > 0) means = ObjNormals(upload, result, count).read();
  TextCursor cursor(upload, kObjStyle);
  TextPatch patch(upload);
  std::size_t vertices = 0, normals = 0;
  for (; cursor.skip_to_word(); cursor.skip_line()) {
    const std::string_view keyword = cursor.word();
    if (keyword == "v") {
      if (vertices == result.mesh.positions.size()) require_vertices(vertices + 1, result.mesh);
      patch.replace_next(cursor, result.mesh.positions[vertices++]);
    } else if (keyword == "vn") {
      const std::optional<Vec3> normal = (*means)[normals++];
      if (normal && !cursor.at_line_end()) patch.replace_next(cursor, *normal);
    }
  }
  require_vertices(vertices, result.mesh);
  return patch.finish();
}

}  // namespace crease
