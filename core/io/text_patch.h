#pragma once

#include <string>
#include <string_view>

#include "core/io/text_cursor.h"
#include "core/mesh/mesh.h"

namespace crease {

/// A copy of a text in which some words are replaced by numbers, from front to back. Everything else stays, to the
/// byte.
class TextPatch {
 public:
  explicit TextPatch(std::string_view text) : text_(text) { patched_.reserve(text.size() + text.size() / 2); }

  /// Replaces a word of the text by the shortest decimal number that reads back to the same double, unless the word is
  /// that number already. An empty word stays.
  void replace(std::string_view word, double value);

  /// Replaces the next three words, of this line or of those that follow.
  void replace_next(TextCursor& cursor, const Vec3& value);

  std::string finish();

 private:
  std::string_view text_;
  std::size_t copied_ = 0;  ///< of the text
  std::string patched_;
};

/// Checks that a file has as many vertices as the result that goes into it. \throw Error mesh_count_mismatch
void require_vertices(std::size_t in_file, const Mesh& result);

}  // namespace crease
