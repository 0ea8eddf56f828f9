#pragma once

#include <string>

#include "core/io/formats.h"

namespace crease {

/// Writes the edges with label ≥ `min_label` as a v1::EdgeLabels message.
std::string write_labels_protobuf(const LabelledMesh& result, double min_label);

/// Protobuf is a format like those of core's table. It stands here because core does not know the schema.
inline constexpr Format kProtobuf = {
    .name = "pb",
    .title = "protobuf",
    .media_types = {"application/x-protobuf", "application/protobuf", "application/vnd.google.protobuf"},
    .extensions = {"pb"},
    .write_labels = write_labels_protobuf};

/// The `format=` of a mesh that comes back as the upload's own file, with nothing but positions and normals replaced.
inline constexpr std::string_view kOriginal = "original";

/// The formats in which each part of a result is handed out, the default first.
Formats mesh_formats();
Formats label_formats();
Formats ridge_formats();
Formats report_formats();

}  // namespace crease
