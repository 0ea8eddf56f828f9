#pragma once

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

#include "core/mesh/mesh.h"

namespace crease {

struct OpenMeshTraits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
};
using HalfEdgeMesh = OpenMesh::TriMesh_ArrayKernelT<OpenMeshTraits>;

/// Flat copy; vertex and face handles become indices. Of a mesh without deleted elements: collect garbage first.
Mesh from_openmesh(const HalfEdgeMesh& half_edges);

/// Half-edge copy with the same vertex and face indices, and with every face starting at the same corner, so that
/// from_openmesh gives `mesh` back.
/// \throw Error mesh_unsupported when a half-edge mesh cannot hold it (non-manifold, inconsistently wound, or a face
///        with a repeated corner); names the first face that does not fit
HalfEdgeMesh to_openmesh(const Mesh& mesh);

}  // namespace crease
