#pragma once

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

#include "core/mesh/mesh.h"

namespace crease {

struct OpenMeshTraits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
};
using HalfEdgeMesh = OpenMesh::TriMesh_ArrayKernelT<OpenMeshTraits>;

/// Copies a half-edge mesh; vertex and face handles become indices. It must not have deleted elements: call
/// garbage_collection() first.
Mesh from_openmesh(const HalfEdgeMesh& half_edges);

/// Copies `mesh` to a half-edge mesh with the same vertex and face indices. Every face keeps its first corner, so that
/// from_openmesh restores `mesh`.
/// \throw Error mesh_unsupported, with the first face that does not fit, if a half-edge mesh cannot represent `mesh`:
///        it is non-manifold, inconsistently wound, or has a face with a repeated corner
HalfEdgeMesh to_openmesh(const Mesh& mesh);

}  // namespace crease
