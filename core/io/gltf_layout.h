#pragma once

#include <cstddef>
#include <vector>

#include "core/io/format.h"
#include "core/io/read_gltf_scene.h"

namespace crease {

/// The vertices of one POSITION accessor in one instance of a mesh, as read_gltf numbers them before it shares them.
struct VertexRange {
  std::size_t first = 0;
  std::size_t count = 0;
  bool weighted = false;
};

/// Which parts of a glTF file the vertices and faces of a mesh came from.
struct GltfLayout {
  /// A primitive of triangles in one instance of its mesh.
  struct Primitive {
    std::size_t instance;
    std::size_t number;  ///< in its mesh
    const gltf::Json* json;
    VertexRange vertices;
    std::size_t first_face, face_count;
  };

  std::vector<gltf::MeshInstance> instances;
  std::vector<Primitive> primitives;
  std::vector<Triangle> triangles;  ///< of vertices before they are shared
  std::vector<Index> vertex_of;     ///< per vertex before they are shared, the vertex of the mesh
};

/// Reads a document and tells what came from where. \throw Error as read_gltf
MeshContent read_gltf(const gltf::Document& document, const DecodeLimits& limits, GltfLayout& layout);

}  // namespace crease
