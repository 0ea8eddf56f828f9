#pragma once

#include <array>
#include <cstddef>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "core/io/text_cursor.h"
#include "core/mesh/mesh.h"

namespace crease {

/// A facet of an ASCII STL file, with its words in the file.
struct StlFacet {
  struct Corner {
    std::array<std::string_view, 3> words;
    Vec3 position;
    std::size_t line;
  };

  std::vector<std::string_view> normal;  ///< up to three words, whatever they are
  std::vector<Corner> corners;
  std::size_t line;  ///< where its loop ends
};

/// Whether the text has a line that begins with "solid" or "facet".
bool is_stl_text(std::string_view text);

/// Reads the facets of ASCII STL one after another. Keywords may be in any case. Text that is neither a keyword nor a
/// number that belongs to one is skipped to the end of its line.
class StlText {
 public:
  explicit StlText(std::string_view text) : text_(text), cursor_(text, {}) {}

  /// Reads the next facet into `facet`. Returns false at the end of the file.
  /// \throw Error mesh_truncated or mesh_syntax with the line, where a facet is not whole, and where text among the
  /// words of facets has three numbers, so that it may be a misspelt part of them; mesh_not_finite
  bool next(StlFacet& facet);

  std::size_t solids() const { return solids_; }
  /// Whether the last solid so far has not come to its end.
  bool is_in_solid() const { return is_in_solid_; }
  /// The lines of which text was skipped.
  std::size_t skipped_lines() const { return skipped_lines_; }
  /// The first of them: "line 7: 'made by hand'".
  const std::string& first_skipped() const { return first_skipped_; }

 private:
  bool next_facet_start();
  void read_corner(StlFacet::Corner& corner);
  std::size_t next_keyword(std::initializer_list<std::string_view> wanted, bool in_facet);
  void expect(std::string_view keyword);
  void skip_name();
  void skip_text(std::string_view word, std::string_view wanted, bool is_among_facets);

  std::string_view text_;
  TextCursor cursor_;
  std::size_t solids_ = 0, facets_ = 0;
  bool is_in_solid_ = false;
  std::size_t keyword_line_ = 0;  ///< where the last word that might be a keyword stands
  std::size_t skipped_lines_ = 0;
  std::string first_skipped_;
};

}  // namespace crease
