#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "tests/support/meshes.h"

namespace crease::test {
namespace fs = std::filesystem;
namespace {

constexpr const char* kCgalArchive = "/usr/share/doc/libcgal-dev/data.tar.gz";

/// Unpacks the archive beside the binaries. Several test processes may do this at once: each unpacks into its own
/// directory, and the first to rename it wins.
fs::path unpack_cgal_meshes() {
  fs::path target = fs::path(CREASED_BIN).parent_path().parent_path() / "cgal-meshes";
  if (fs::exists(target)) return target;
  const fs::path scratch = target.string() + "." + std::to_string(getpid());
  fs::create_directories(scratch);
  const std::string command =
      std::string("tar -xzf '") + kCgalArchive + "' -C '" + scratch.string() + "' --strip-components=2 data/meshes";
  const int status = std::system(command.c_str());  // NOLINT(concurrency-mt-unsafe)
  if (status != 0) throw std::runtime_error("cannot run: " + command);
  std::error_code raced;
  fs::rename(scratch, target, raced);
  if (raced) fs::remove_all(scratch);
  return target;
}

}  // namespace

std::optional<fs::path> development_mesh(const std::string& relative) {
  const char* configured = std::getenv("CREASED_MESHES");  // NOLINT(concurrency-mt-unsafe)
  const fs::path root =
      configured != nullptr ? fs::path(configured) : fs::path(CREASED_SOURCE_DIR).parent_path() / "shared" / "meshes";
  const fs::path path = root / relative;
  return fs::exists(path) ? std::optional(path) : std::nullopt;
}

std::optional<fs::path> cgal_mesh(const std::string& name) {
  if (!fs::exists(kCgalArchive)) return std::nullopt;
  const fs::path path = unpack_cgal_meshes() / name;
  return fs::exists(path) ? std::optional(path) : std::nullopt;
}

std::string read_file(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot open " + path.string());
  std::ostringstream bytes;
  bytes << file.rdbuf();
  return std::move(bytes).str();
}

}  // namespace crease::test
