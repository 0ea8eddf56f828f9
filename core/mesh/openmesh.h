#pragma once

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

#include "core/mesh/mesh.h"

namespace crease {

struct OpenMeshTraits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
};
using HalfEdgeMesh = OpenMesh::TriMesh_ArrayKernelT<OpenMeshTraits>;

/// Flat copy; vertex and face handles become indices.
Mesh from_openmesh(const HalfEdgeMesh& half_edges);

/// Half-edge copy with the same vertex indices.
/// \throw Error mesh_unsupported when a half-edge mesh cannot hold it (non-manifold or inconsistently wound); names the face
HalfEdgeMesh to_openmesh(const Mesh& mesh);

}  // namespace crease
