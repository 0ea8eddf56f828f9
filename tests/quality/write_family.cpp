#include <fmt/format.h>
#include <fmt/os.h>

#include <cstdio>
#include <exception>
#include <filesystem>

#include "tests/support/meshes.h"

/// Writes the mesh family of the tests as OBJ files into a folder: write_family FOLDER
int main(int count, char** arguments) try {
  if (count != 2) {
    fmt::print(stderr, "usage: write_family FOLDER\n");
    return 2;
  }
  const std::filesystem::path folder = arguments[1];
  std::filesystem::create_directories(folder);
  for (const crease::test::NamedMesh& named : crease::test::mesh_family()) {
    auto file = fmt::output_file((folder / (named.name + ".obj")).string());
    for (const crease::Vec3& p : named.mesh.positions) file.print("v {} {} {}\n", p.x(), p.y(), p.z());
    for (const auto& [a, b, c] : named.mesh.triangles) file.print("f {} {} {}\n", a + 1, b + 1, c + 1);
  }
} catch (const std::exception& error) {
  std::fputs(error.what(), stderr);
  return 1;
}
