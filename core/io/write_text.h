#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/io/labelled_mesh.h"
#include "core/io/write_number.h"

namespace crease {

/// An empty text with room for the positions and faces of the mesh.
std::string reserved_text(const Mesh& mesh);

/// Appends three numbers with blanks between them.
template <typename Vector>
void append_numbers(std::string& text, const Vector& vector) {
  append_number(text, vector.x());
  text += ' ';
  append_number(text, vector.y());
  text += ' ';
  append_number(text, vector.z());
}

/// Appends a line for each vertex: `before`, then x, y and z with blanks between them, and if there are `colours`, red,
/// green, blue.
void append_positions(std::string& text, const Mesh& mesh, std::string_view before,
                      const std::vector<Colour>& colours = {});

/// Appends a line for each face: `before`, then its vertices counted from `first_index`.
void append_faces(std::string& text, std::span<const Triangle> faces, std::string_view before, Index first_index);

/// Room that a line or item for one edge needs.
inline constexpr std::size_t kBytesPerEdge = 40;

/// Appends a label with up to six digits, or with all of them where rounding would lift it to kRidgeThreshold.
void append_label(std::string& text, double label);

/// Appends an angle in degrees with up to six digits.
void append_degrees(std::string& text, double radians);

/// The edges whose label is at least `min_label`, in order.
std::vector<std::size_t> edges_from(const LabelledMesh& result, double min_label);

}  // namespace crease
