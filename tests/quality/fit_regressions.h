#pragma once

#include <string>

#include "tests/quality/fit_scans.h"

namespace crease::quality {

/// Writes what the regression of normals sees of faces of results, and where they should look, to a file that
/// fit_normals.py reads: models of the training pairs and of folders with all kinds of noise. `pass`, from 0, is the
/// one that finds them so.
void measure_normals(const Part& of, std::size_t pass, const std::string& file);

/// Writes what the regression of labels sees of edges, and which of them are ridges, for fit_labels.py.
void measure_labels(const Part& of, const std::string& file);

}  // namespace crease::quality
