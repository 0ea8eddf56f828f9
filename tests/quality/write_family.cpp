#include <fmt/format.h>
#include <fmt/os.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <filesystem>

#include "tests/support/meshes.h"

int main(int count, char** arguments) try {
  CLI::App app("Writes the mesh family of the tests as OBJ files into a folder");
  std::filesystem::path folder;
  app.add_option("folder", folder, "is made where it is not there")->required();
  CLI11_PARSE(app, count, arguments);
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
