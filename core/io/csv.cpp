#include "core/io/csv.h"

#include "core/io/write_number.h"
#include "core/io/write_text.h"

namespace crease {

std::string write_labels_csv(const LabelledMesh& result, double min_label) {
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
