#include "server/api/route.h"

namespace creased {

std::vector<std::string> format_names(const crease::Formats& formats) {
  std::vector<std::string> names;
  for (const auto* format : formats) names.emplace_back(format->name);
  return names;
}

std::vector<std::string> media_types(const crease::Formats& formats) {
  std::vector<std::string> types;
  for (const auto* format : formats) types.emplace_back(format->media_types.front());
  return types;
}

}  // namespace creased
