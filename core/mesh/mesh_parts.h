#pragma once

#include <vector>

#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease {

/// Components of a mesh that belong together, as a mesh of their own. Its vertices, faces and edges are in the order in
/// which the whole has them.
struct MeshPart {
  Mesh mesh;
  std::vector<Index> vertices, edges;  ///< their numbers in the whole
};

/// With so many faces a component is judged on its own. A smaller one joins what is similar, since a small coarse mesh
/// hardly shows whether it has noise at all. It needs fewer where nothing is similar: where its edges are longer or
/// shorter than those of every larger part by more than this factor.
inline constexpr std::size_t kFewestFacesOfPart = 4000, kFewestFacesOfUnlikePart = 500;
inline constexpr double kUnlikeEdges = 1.6;
/// Every part costs a choice. Those of meshes that take seconds have at least a sixteenth of the faces.
inline constexpr std::size_t kMostParts = 32, kMostPartsOfSeconds = 16;

/// Each component that is judged on its own makes a part; every other one joins the part whose edges are closest in
/// length. The part of the component with the most faces comes first; it has the isolated vertices, too. Empty where
/// the whole is one part.
std::vector<MeshPart> parts_of(const Mesh& mesh, const Topology& topology);

}  // namespace crease
