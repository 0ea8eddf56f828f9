#include "proto/result_formats.h"

#include <numbers>

#include "crease/v1/result.pb.h"

namespace crease {

std::string write_labels_protobuf(const LabelledMesh& result, double min_label) {
  v1::EdgeLabels message;
  for (std::size_t i = 0; i < result.edges.size(); ++i) {
    if (result.labels[i] < min_label) continue;
    message.add_edges(result.edges[i].v0);
    message.add_edges(result.edges[i].v1);
    message.add_labels(result.labels[i]);
    message.add_dihedral_deg(result.dihedral_rad[i] * 180 / std::numbers::pi);
  }
  message.set_count(static_cast<std::uint32_t>(message.labels_size()));
  message.set_threshold(min_label);
  return message.SerializeAsString();
}

Formats mesh_formats() { return formats_with(&Format::write); }

Formats label_formats() {
  Formats formats = text_first(formats_with(&Format::write_labels));
  formats.push_back(&kProtobuf);
  return formats;
}

Formats ridge_formats() { return text_first(formats_with(&Format::write_ridges)); }

Formats report_formats() { return {&format_row(MeshFormat::kJson), &kProtobuf}; }

}  // namespace crease
