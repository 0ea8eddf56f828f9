#pragma once

#include <algorithm>
#include <string_view>
#include <utility>

namespace crease::fuzz {

/// Removes the first line from `rest` and returns it.
inline std::string_view take_line(std::string_view& rest) {
  const std::size_t end = std::min(rest.find('\n'), rest.size());
  const std::string_view line = rest.substr(0, end);
  rest.remove_prefix(std::min(end + 1, rest.size()));
  return line;
}

/// Removes the first line "name=value" from `rest` and returns name and value.
inline std::pair<std::string_view, std::string_view> take_pair(std::string_view& rest) {
  const std::string_view line = take_line(rest);
  const std::size_t equals = std::min(line.find('='), line.size());
  return {line.substr(0, equals), line.substr(std::min(equals + 1, line.size()))};
}

}  // namespace crease::fuzz
