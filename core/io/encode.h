#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/features/ridge_lines.h"
#include "core/features/vertex_classes.h"
#include "core/io/mesh_format.h"
#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease {

/// A mesh with a ridge label for every edge: what a job returns.
struct LabelledMesh {
  Mesh mesh;
  std::vector<Edge> edges;
  std::vector<double> labels;          ///< in [0, 1], per edge
  std::vector<double> dihedral_rad;    ///< signed, per edge
  std::vector<VertexClass> classes{};  ///< per vertex, or none
  std::vector<Index> segments{};       ///< per face, or none
  std::vector<RidgeLine> ridge_lines{};
  std::vector<Index> corners{};  ///< the vertices of class corner, ascending
};

/// The mesh in `format`, the same bytes for the same result. `extras` goes into glTF/GLB as asset.extras and into JSON
/// as "extras", and nowhere else.
///
/// - OBJ, OFF, JSON: positions as the shortest decimal numbers that read back to the same doubles.
///   JSON: {"positions", "triangles", "edges", "labels", "dihedral_deg", "extras"}, and before the extras "classes"
///   (per vertex: 0 smooth, 1 ridge, 2 corner) and "segments" (per face) where the result has them.
/// - PLY: binary, little endian, positions in double precision.
/// - STL: binary; facets in the order of the faces, in single precision.
/// - GLB: one node, one mesh. Primitive 0, triangles: POSITION, NORMAL (area-weighted, split along ridges, boundaries
///   and edges across which faces are not wound alike), `_LABEL` (the largest label of the vertex's edges), `_SOURCE`
///   (the vertex of the upload that it is). The first vertices are the upload's, in order; copies follow. Primitive 1,
///   lines over the same vertices: the edges with label ≥ kRidgeThreshold; left out when there are none.
///   Where the result has them, primitive 0 also has `_CLASS` (as in JSON) and `_SEGMENT` (of the vertex's faces, −1
///   without faces): vertices are then split between segments as well, but normals are not.
/// - glTF is GLB's JSON with its buffer embedded as a data URI.
///
/// \throw Error mesh_unsupported when a coordinate does not fit into single precision (STL, glTF, GLB), or for more
///        than 2²⁴ vertices (glTF, GLB); mesh_no_faces for a mesh without faces (glTF, GLB)
std::string encode_mesh(const LabelledMesh& result, MeshFormat format, const nlohmann::ordered_json& extras = {});

/// {"edges": [[i, j], …], "labels": […], "dihedral_deg": […], "count", "threshold"}: the `count` edges with label ≥
/// `threshold` = min_label. Labels and degrees have up to six digits; rounding lifts no label to kRidgeThreshold.
std::string encode_labels_json(const LabelledMesh& result, double min_label = 0);

/// "v0,v1,label,dihedral_deg" with a heading line; the same edges and numbers as the JSON.
std::string encode_labels_csv(const LabelledMesh& result, double min_label = 0);

/// {"ridges": [{"vertices", "closed", "length", "mean_label", "mean_dihedral_deg"}, …], "count", "corners"}. `corners`
/// are vertex indices as those of the lines are; numbers that are no indices have up to six digits.
std::string encode_ridges_json(const std::vector<RidgeLine>& lines, const std::vector<Index>& corners);

/// The ridge lines as GLB: one node, one mesh, one primitive of lines over vertices that no two ridge lines share, with
/// POSITION, `_SOURCE` (the vertex of the mesh) and `_LINE` (the number of the ridge line). Without ridge lines the
/// node has no mesh. `extras` goes into asset.extras. \throw Error mesh_unsupported as encode_mesh does
std::string encode_ridges_glb(const Mesh& mesh, const std::vector<RidgeLine>& lines,
                              const nlohmann::ordered_json& extras = {});

}  // namespace crease
