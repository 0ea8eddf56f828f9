#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "client/cli/service_client.h"
#include "core/io/format.h"

namespace crease::client {

/// The options --ridge-lines, --compress and --quantized of a mesh that is written.
struct StyleOptions {
  bool ridge_lines = false, quantized = false;
  std::string compress;

  bool any() const { return ridge_lines || quantized || !compress.empty(); }
  /// \throw Error parameter_invalid for a format that has no such choice; null for the upload's own file
  void check(const Format* format) const;
  MeshStyle read() const { return {ridge_lines, !compress.empty(), quantized}; }
  void add_to(Query& query) const;
};

void add_style_options(CLI::App& command, StyleOptions& options);

}  // namespace crease::client
