#include "core/io/dropped_attributes.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <string_view>
#include <utility>

#include "core/io/formats.h"

namespace crease {
namespace {

bool keeps(const Format& format, std::string_view attribute) {
  return std::ranges::find(format.keeps, attribute) != format.keeps.end();
}

/// "glb, gltf and ply"; empty if no format keeps it.
std::string keepers_of(std::string_view attribute) {
  Formats keepers;
  for (const Format& format : kFormats) {
    if (keeps(format, attribute)) keepers.push_back(&format);
  }
  return name_list(keepers, "and");
}

}  // namespace

std::vector<std::string> dropped_in(const Format& format, const std::vector<std::string>& attributes) {
  std::vector<std::string> dropped;
  std::ranges::copy_if(attributes, std::back_inserter(dropped),
                       [&](const std::string& attribute) { return !keeps(format, attribute); });
  return dropped;
}

std::string dropped_text(const Format& format, const std::vector<std::string>& attributes) {
  const std::vector<std::string> dropped = dropped_in(format, attributes);
  return dropped.empty() ? "" : fmt::format("{} does not keep: {}", format.name, fmt::join(dropped, ", "));
}

std::string describe_dropped(const std::vector<std::string>& attributes) {
  std::vector<std::pair<std::string, std::vector<std::string>>> by_keepers;
  for (const std::string& attribute : attributes) {
    const std::string keepers = keepers_of(attribute);
    auto found = std::ranges::find(by_keepers, keepers, [](const auto& one) { return one.first; });
    if (found == by_keepers.end()) found = by_keepers.insert(found, {keepers, {}});
    found->second.push_back(attribute);
  }
  std::string text = "format=original keeps everything";
  for (const auto& [keepers, names] : by_keepers) {
    const std::string but = keepers.empty() ? "" : " but " + keepers;
    text += fmt::format("; lost in all other formats{}: {}", but, fmt::join(names, ", "));
  }
  return text;
}

}  // namespace crease
