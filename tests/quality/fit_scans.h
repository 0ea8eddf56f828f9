#pragma once

#include <filesystem>
#include <functional>
#include <initializer_list>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "core/choice/patches.h"
#include "core/mesh/mesh.h"
#include "tests/quality/pairs.h"

namespace crease::quality {

/// What to measure: every so manieth item, so that several processes share the work.
struct Part {
  std::size_t part = 0, parts = 1;
  std::string meshes;               ///< folder of pairs with measured noise
  std::vector<std::string> models;  ///< folders
  std::string kind;                 ///< of scans: views, fused, or whole; all of them if empty
};

/// A mesh in a file. Those named alike but for what follows the last underscore are a family.
struct ModelFile {
  std::filesystem::path path;
  std::string name() const { return path.stem().string(); }
  std::string family() const { return name().substr(0, name().rfind('_')); }
  Mesh read() const;
};

/// Those of a folder, by name.
std::vector<ModelFile> model_files(const std::string& folder);

/// The part of a mesh that patches of it cover.
Mesh part_of(const Mesh& mesh, const Patches& patches);

struct TrainingModel {
  std::string name, family;
  bool is_of_folder = false;
  std::function<std::optional<Mesh>()> load;  ///< none if it is not on this machine
};

/// Those of the pairs of the sets, each once, and those of folders.
std::vector<TrainingModel> training_models(std::initializer_list<PairSet> sets,
                                           const std::vector<std::string>& folders);

/// A mesh with noise of one wavelength or of several along the normals, of 0.06 to 0.72 edge lengths.
Mesh with_waves(const Mesh& original, std::mt19937_64& random);

/// Prints what the model of scans sees of training models with correlated noise, with independent noise, and without,
/// and the errors of the settings and of the automatic one for independent noise; a pair per line.
void measure_scans(const Part& of);

/// Prints core/choice/scan_error_table.h, and what the choice costs to stderr. With `keeps`, the pairs of the present
/// table are among those that it is fitted to.
void write_scan_table(const std::vector<std::string>& files, bool keeps);

}  // namespace crease::quality
