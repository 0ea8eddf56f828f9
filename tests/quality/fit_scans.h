#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace crease::quality {

/// What to measure: every so manieth item, so that several processes share the work.
struct Part {
  std::size_t part = 0, parts = 1;
  std::string meshes;               ///< folder of pairs with measured noise
  std::vector<std::string> models;  ///< folders
};

/// The files of a folder, by name.
std::vector<std::filesystem::path> files_of(const std::string& folder);

/// Prints what the model of scans sees of training models with correlated noise, with independent noise, and without,
/// and the errors of the settings and of the automatic one for independent noise; a pair per line.
void measure_scans(const Part& of);

/// Prints core/choice/scan_error_table.h, and what the choice costs to stderr.
void write_scan_table(const std::vector<std::string>& files);

}  // namespace crease::quality
