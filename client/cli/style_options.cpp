#include "client/cli/style_options.h"

#include <fmt/format.h>

#include "core/io/formats.h"

namespace crease::client {
namespace {

void require(bool asked, const std::string& option, const std::string& value, const Format* format, bool Format::*has) {
  if (!asked || (format != nullptr && format->*has)) return;
  throw Error::parameter(crease::code::kParameterInvalid, option, value,
                         fmt::format("no such option with this format; {} has it", name_list(formats_that(has))));
}

}  // namespace

void StyleOptions::check(const Format* format) const {
  require(ridge_lines, "ridge-lines", "true", format, &Format::has_ridge_lines);
  require(!compress.empty(), "compress", compress, format, &Format::has_compression);
  require(quantized, "quantized", "true", format, &Format::has_compression);
}

void StyleOptions::add_to(Query& query) const {
  if (ridge_lines) query.emplace("ridges", "lines");
  if (!compress.empty()) query.emplace("compress", compress);
  if (quantized) query.emplace("quantized", "true");
}

void add_style_options(CLI::App& command, StyleOptions& options) {
  const std::string of_gltf = name_list(formats_that(&Format::has_compression));
  command.add_flag("--ridge-lines", options.ridge_lines,
                   "Add the ridges as line elements: " + name_list(formats_that(&Format::has_ridge_lines)));
  command.add_option("--compress", options.compress, "meshopt: compress without loss (" + of_gltf + ")")
      ->check(CLI::IsMember({"meshopt"}));
  command.add_flag("--quantized", options.quantized,
                   "Positions in 16 bits over the longest side of the mesh, normals in 8 bits (" + of_gltf + ")");
}

}  // namespace crease::client
