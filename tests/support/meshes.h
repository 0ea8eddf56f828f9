#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease::test {

/// A mesh with its properties.
struct NamedMesh {
  std::string name;
  Mesh mesh;
  bool manifold = true;  ///< every edge has one or two faces
  bool closed = false;   ///< no boundary
  bool degenerate = false;
};

/// One mesh of each kind: closed, open, several components, non-manifold, degenerate, duplicate faces, isolated
/// vertices, inconsistently wound, Möbius strip, tiny. Properties of meshes are tested on all of them.
std::vector<NamedMesh> mesh_family();

Mesh grid(int columns, int rows, double spacing = 1.0);              ///< flat, open, alternating diagonals
Mesh icosphere(int subdivisions, double radius = 1.0);               ///< closed
Mesh cube(int per_side, double side = 1.0);                          ///< closed, twelve straight ridges
Mesh cylinder(int around, int along, double radius, double height);  ///< closed, two circular ridges
Mesh mobius(int segments);
Mesh moved(Mesh mesh, double scale, const Vec3& way);  ///< scaled, then moved
Mesh joined(const std::vector<Mesh>& meshes);          ///< side by side, in their order

/// A stepped block with a chamfer and a cylindrical boss: a CAD part with known ridges.
struct CadPart {
  Mesh mesh;
  std::vector<Edge> ridges;
};
CadPart cad_part(int resolution);

/// A file of the development models, for example "Fandisk0.3/noisy.obj", in the folder CREASED_MESHES or in
/// ../shared/meshes beside the checkout; nullopt when it does not exist.
std::optional<std::filesystem::path> development_mesh(const std::string& relative);

/// A noise-free model of Debian's libcgal-demo, for example "fandisk.off", unpacked once into the build tree; nullopt
/// when the package is not installed.
std::optional<std::filesystem::path> cgal_mesh(const std::string& name);

std::string read_file(const std::filesystem::path& path);

}  // namespace crease::test
