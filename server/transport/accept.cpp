#include "server/transport/accept.h"

#include <algorithm>
#include <charconv>
#include <vector>

#include "core/base/text.h"
#include "server/transport/http_head.h"

namespace creased {
namespace {

using crease::equals_ignoring_case;
using crease::trimmed;

struct MediaRange {
  std::string_view type;
  double quality = 1;
};

double quality_of(std::string_view parameters) {
  while (!parameters.empty()) {
    parameters.remove_prefix(1);
    const auto end = std::min(parameters.find(';'), parameters.size());
    const std::string_view parameter = trimmed(parameters.substr(0, end));
    parameters.remove_prefix(end);
    if (!parameter.starts_with("q=") && !parameter.starts_with("Q=")) continue;
    double quality = 0;
    std::from_chars(parameter.data() + 2, parameter.data() + parameter.size(), quality);
    return std::clamp(quality, 0.0, 1.0);
  }
  return 1;
}

std::vector<MediaRange> parse_accept(std::string_view accept) {
  std::vector<MediaRange> ranges;
  while (!accept.empty()) {
    const auto comma = std::min(accept.find(','), accept.size());
    const std::string_view item = trimmed(accept.substr(0, comma));
    accept.remove_prefix(std::min(comma + 1, accept.size()));
    const auto semicolon = std::min(item.find(';'), item.size());
    if (!item.empty()) ranges.push_back({trimmed(item.substr(0, semicolon)), quality_of(item.substr(semicolon))});
  }
  return ranges;
}

/// How specifically a media range matches a type: 0 not at all, 1 as */*, 2 as type/*, 3 exactly.
int specificity(std::string_view range, std::string_view type) {
  if (range == "*/*" || range == "*") return 1;
  if (equals_ignoring_case(range, type)) return 3;
  const auto slash = type.find('/');
  return range.ends_with("/*") && equals_ignoring_case(range.substr(0, range.size() - 2), type.substr(0, slash)) ? 2
                                                                                                                 : 0;
}

/// The quality that the most specific matching range gives to `type`; 0 when none matches.
double quality_for(const std::vector<MediaRange>& ranges, std::string_view type) {
  int most_specific = 0;
  double quality = 0;
  for (const auto& range : ranges) {
    const int match = specificity(range.type, type);
    if (match > most_specific) {
      most_specific = match;
      quality = range.quality;
    }
  }
  return quality;
}

}  // namespace

std::optional<std::size_t> negotiate(std::string_view accept, std::span<const std::string_view> offered) {
  const auto ranges = parse_accept(accept);
  if (ranges.empty()) return 0;
  std::optional<std::size_t> best;
  double highest = 0;
  for (std::size_t i = 0; i < offered.size(); ++i) {
    const double quality = quality_for(ranges, offered[i]);
    if (quality > highest) {
      highest = quality;
      best = i;
    }
  }
  return best;
}

}  // namespace creased
