#include "core/io/write_text.h"

#include <cmath>

#include "core/io/write_number.h"

namespace crease {

std::string reserved_text(const Mesh& mesh) {
  // Enough for three doubles or three indices; a longer line makes the text grow.
  constexpr std::size_t kBytesPerVertex = 64, kBytesPerFace = 32;
  std::string text;
  text.reserve(kBytesPerVertex * mesh.positions.size() + kBytesPerFace * mesh.triangles.size() + 256);
  return text;
}

void append_positions(std::string& text, const Mesh& mesh, std::string_view before,
                      const std::vector<Colour>& colours) {
  for (std::size_t vertex = 0; vertex < mesh.positions.size(); ++vertex) {
    text += before;
    append_numbers(text, mesh.positions[vertex]);
    for (std::size_t k = 0; k < 3 && !colours.empty(); ++k) {
      text += ' ';
      append_number(text, colours[vertex][k]);
    }
    text += '\n';
  }
}

void append_faces(std::string& text, std::span<const Triangle> faces, std::string_view before, Index first_index) {
  for (const auto& [a, b, c] : faces) {
    text += before;
    append_number(text, a + first_index);
    text += ' ';
    append_number(text, b + first_index);
    text += ' ';
    append_number(text, c + first_index);
    text += '\n';
  }
}

void append_label(std::string& text, double label) {
  const bool rounds_up_to_ridge = label < kRidgeThreshold && label > kRidgeThreshold - 1e-6;
  if (rounds_up_to_ridge) {
    append_number(text, label);
  } else {
    append_rounded(text, label);
  }
}

void append_degrees(std::string& text, double radians) { append_rounded(text, radians * (180 / M_PI)); }

std::vector<std::size_t> edges_from(const LabelledMesh& result, double min_label) {
  std::vector<std::size_t> selected;
  for (std::size_t edge = 0; edge < result.edges.size(); ++edge) {
    if (result.labels[edge] >= min_label) selected.push_back(edge);
  }
  return selected;
}

}  // namespace crease
