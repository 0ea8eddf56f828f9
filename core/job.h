#pragma once

#include <optional>
#include <string_view>

#include "core/io/decode.h"
#include "core/io/encode.h"
#include "core/mesh/input_facts.h"
#include "core/smooth/smooth.h"

namespace crease {

/// An upload that decoded and passed the checks.
struct CheckedInput {
  Mesh mesh;
  MeshFormat format = MeshFormat::kObj;
  Topology topology;                 ///< of `mesh`
  std::optional<WeldedMesh> welded;  ///< what is smoothed, where that is not `mesh` itself
  InputFacts facts;
  std::vector<double> weights;          ///< of the likelihood per vertex, at most kMaxWeight; empty for 1 everywhere
  std::vector<std::string> attributes;  ///< what the file has beside positions and faces, by attributes_of
  std::vector<Warning> warnings;
};

/// Standard deviations of the vertices of a result along their normals, in mean edge lengths.
struct UncertaintyFacts {
  double mean = 0, median = 0, max = 0;
};

struct ResultFacts {
  std::uint32_t ridge_edges = 0;
  double ridge_length = 0;  ///< in the upload's units
  std::uint32_t ridge_lines = 0, corners = 0, segments = 0;
  double max_displacement = 0;         ///< in mean edge lengths
  double rms_displacement = 0;         ///< in mean edge lengths
  double volume_change = 0;            ///< relative; of the signed volume, 0 when the upload encloses none
  double seconds = 0;                  ///< of smoothing alone
  std::optional<ChoiceReport> choice;  ///< of solver=descent; where components are smoothed apart, that of the largest
  std::vector<ChoiceReport> other_choices;  ///< of the other components that are smoothed apart
  std::optional<UncertaintyFacts> uncertainty;
};

struct JobOutput {
  LabelledMesh result;
  ResultFacts facts;
  std::vector<SweepRecord> sweeps;
  /// vertices_welded_nearby, with the number of those within the tolerance; single_precision_rounds, with the loss in
  /// mean edge lengths
  std::vector<Warning> warnings;
  bool cancelled = false;
};

/// Checks a mesh and finds out what is to be smoothed. `weights` has one per vertex, or is empty. `threads` are as in
/// SmoothOptions.
/// \throw Error mesh_no_faces, mesh_not_finite, mesh_no_extent
CheckedInput check_mesh(Mesh mesh, std::vector<double> weights = {}, std::uint32_t threads = 1);

/// decode → check. `weights` is a JSON array with one for every decoded vertex (of STL: after welding) and goes before
/// those of the mesh file. Warnings beside those of decode_mesh and inspect: weights_replaced, where both have some;
/// weights_all_zero, where no measured position is believed.
/// \throw Error mesh_*, weights_invalid
CheckedInput check_input(std::string_view bytes, std::optional<MeshFormat> format, const DecodeLimits& limits = {},
                         std::optional<std::string_view> weights = {}, std::uint32_t threads = 1);

/// weld → smooth → facts: the one path of the service, `--local` and the tests. Coincident vertices of the upload get
/// the same result, and their edges the label of the edge between them. Sweeps are shown as those of the upload.
JobOutput run_job(const CheckedInput& input, const SmoothOptions& options, RunContext& context);

}  // namespace crease
