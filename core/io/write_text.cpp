#include <fmt/format.h>

#include "core/io/write_formats.h"
#include "core/io/write_number.h"

namespace crease {
namespace {

// Room for a line of three doubles or three indices; more would be taken if it ever were too little.
constexpr std::size_t kBytesPerVertex = 64, kBytesPerFace = 32, kBytesPerEdge = 40;

void append_positions(std::string& text, const Mesh& mesh, std::string_view before, std::string_view after) {
  for (const Vec3& position : mesh.positions) {
    text += before;
    append_number(text, position.x());
    text += ' ';
    append_number(text, position.y());
    text += ' ';
    append_number(text, position.z());
    text += after;
  }
}

void append_faces(std::string& text, const Mesh& mesh, std::string_view before, Index first_index) {
  for (const auto& [a, b, c] : mesh.triangles) {
    text += before;
    append_number(text, a + first_index);
    text += ' ';
    append_number(text, b + first_index);
    text += ' ';
    append_number(text, c + first_index);
    text += '\n';
  }
}

std::string reserved(const Mesh& mesh) {
  std::string text;
  text.reserve(kBytesPerVertex * mesh.positions.size() + kBytesPerFace * mesh.triangles.size() + 256);
  return text;
}

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

void append_label(std::string& text, double label) {
  const bool rounds_up_to_ridge = label < kRidgeThreshold && label > kRidgeThreshold - 1e-6;
  if (rounds_up_to_ridge) {
    append_number(text, label);
  } else {
    append_rounded(text, label);
  }
}

void append_degrees(std::string& text, double radians) { append_rounded(text, radians * (180 / M_PI)); }

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

std::vector<std::size_t> edges_from(const LabelledMesh& result, double min_label) {
  std::vector<std::size_t> selected;
  for (std::size_t edge = 0; edge < result.edges.size(); ++edge) {
    if (result.labels[edge] >= min_label) selected.push_back(edge);
  }
  return selected;
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

std::string write_obj(const Mesh& mesh) {
  std::string text = reserved(mesh);
  append_positions(text, mesh, "v ", "\n");
  append_faces(text, mesh, "f ", 1);
  return text;
}

std::string write_off(const Mesh& mesh) {
  std::string text = reserved(mesh);
  text += fmt::format("OFF\n{} {} 0\n", mesh.positions.size(), mesh.triangles.size());
  append_positions(text, mesh, "", "\n");
  append_faces(text, mesh, "3 ", 0);
  return text;
}

std::string write_json(const LabelledMesh& result, const nlohmann::ordered_json& extras) {
  std::string text = reserved(result.mesh);
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
  if (!result.segments.empty()) {
    text += ",\n";
    append_array(text, "segments", result.segments, [&](Index segment) { append_number(text, segment); });
  }
  text += ",\n\"extras\":";
  text += extras.is_null() ? "{}" : extras.dump();
  text += "}\n";
  return text;
}

std::string encode_labels_json(const LabelledMesh& result, double min_label) {
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

std::string encode_ridges_json(const std::vector<RidgeLine>& lines, const std::vector<Index>& corners) {
  std::string text = "{";
  append_array(text, "ridges", lines, [&](const RidgeLine& line) { append_ridge_line(text, line); });
  text += ",\n\"count\":";
  append_number(text, lines.size());
  text += ',';
  append_array(text, "corners", corners, [&](Index vertex) { append_number(text, vertex); });
  text += "}\n";
  return text;
}

std::string encode_labels_csv(const LabelledMesh& result, double min_label) {
  const std::vector<std::size_t> selected = edges_from(result, min_label);
  std::string text = "v0,v1,label,dihedral_deg\n";
  text.reserve(kBytesPerEdge * selected.size() + 256);
  for (const std::size_t edge : selected) {
    append_number(text, result.edges[edge].v0);
    text += ',';
    append_number(text, result.edges[edge].v1);
    text += ',';
    append_label(text, result.labels[edge]);
    text += ',';
    append_degrees(text, result.dihedral_rad[edge]);
    text += '\n';
  }
  return text;
}

}  // namespace crease
