#include "core/io/json.h"

#include <array>
#include <nlohmann/json.hpp>

#include "core/io/write_number.h"
#include "core/io/write_text.h"

namespace crease {
namespace {

/// "name": [item, item, …] with items appended by `append_item`.
template <typename Items, typename Append>
void append_array(std::string& text, std::string_view name, const Items& items, Append append_item) {
  text += '"';
  text += name;
  text += "\":[";
  bool first = true;
  for (const auto& item : items) {
    if (!first) text += ',';
    first = false;
    append_item(item);
  }
  text += ']';
}

template <typename Items>
void append_tuple(std::string& text, const Items& items) {
  char before = '[';
  for (const auto& item : items) {
    text += before;
    append_number(text, item);
    before = ',';
  }
  text += ']';
}

void append_ridge_line(std::string& text, const RidgeLine& line) {
  text += "\n{";
  append_array(text, "vertices", line.vertices, [&](Index vertex) { append_number(text, vertex); });
  text += line.closed ? ",\"closed\":true,\"length\":" : ",\"closed\":false,\"length\":";
  append_rounded(text, line.length);
  text += ",\"mean_label\":";
  append_label(text, line.mean_label);
  text += ",\"mean_dihedral_deg\":";
  append_degrees(text, line.mean_dihedral_rad);
  text += '}';
}

/// Edges, labels and angles of the selected edges as members of a JSON object.
void append_labels(std::string& text, const LabelledMesh& result, const std::vector<std::size_t>& selected) {
  append_array(text, "edges", selected, [&](std::size_t edge) {
    append_tuple(text, std::array{result.edges[edge].v0, result.edges[edge].v1});
  });
  text += ",\n";
  append_array(text, "labels", selected, [&](std::size_t edge) { append_label(text, result.labels[edge]); });
  text += ",\n";
  append_array(text, "dihedral_deg", selected,
               [&](std::size_t edge) { append_degrees(text, result.dihedral_rad[edge]); });
}

}  // namespace

Likeness looks_like_json(const Sample& sample) {
  const bool is_wide = sample.word.find('\0') != std::string_view::npos;  // as in UTF-16
  return sample.word.starts_with('{') && !is_wide ? Likeness::kText : Likeness::kUnlike;
}

std::string write_json(const LabelledMesh& result, const nlohmann::ordered_json& extras, const MeshStyle& /*style*/) {
  std::string text = reserved_text(result.mesh);
  text.reserve(text.capacity() + kBytesPerEdge * result.edges.size());
  text += '{';
  append_array(text, "positions", result.mesh.positions, [&](const Vec3& position) { append_tuple(text, position); });
  text += ",\n";
  append_array(text, "triangles", result.mesh.triangles,
               [&](const Triangle& triangle) { append_tuple(text, triangle); });
  text += ",\n";
  append_labels(text, result, edges_from(result, 0));
  if (!result.classes.empty()) {
    text += ",\n";
    append_array(text, "classes", result.classes,
                 [&](VertexClass vertex_class) { append_number(text, static_cast<int>(vertex_class)); });
  }
  if (!result.sigma.empty()) {
    text += ",\n";
    append_array(text, "sigma", result.sigma, [&](double sigma) { append_number(text, sigma); });
  }
  if (!result.segments.empty()) {
    text += ",\n";
    append_array(text, "segments", result.segments,
                 [&](Index segment) { append_number(text, segment == kNone ? -1 : std::int64_t{segment}); });
  }
  text += ",\n\"extras\":";
  text += extras.is_null() ? "{}" : extras.dump();
  text += "}\n";
  return text;
}

std::string write_labels_json(const LabelledMesh& result, double min_label) {
  const std::vector<std::size_t> selected = edges_from(result, min_label);
  std::string text;
  text.reserve(kBytesPerEdge * selected.size() + 256);
  text += '{';
  append_labels(text, result, selected);
  text += ",\n\"count\":";
  append_number(text, selected.size());
  text += ",\"threshold\":";
  append_number(text, min_label);
  text += "}\n";
  return text;
}

std::string write_ridges_json(const LabelledMesh& result, const nlohmann::ordered_json& /*extras*/) {
  std::string text = "{";
  append_array(text, "ridges", result.ridge_lines, [&](const RidgeLine& line) { append_ridge_line(text, line); });
  text += ",\n\"count\":";
  append_number(text, result.ridge_lines.size());
  text += ',';
  append_array(text, "corners", result.corners, [&](Index vertex) { append_number(text, vertex); });
  text += "}\n";
  return text;
}

}  // namespace crease
