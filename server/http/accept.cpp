#include "server/http/accept.h"

#include <algorithm>
#include <charconv>
#include <vector>

#include "server/http/http_head.h"

namespace creased {
namespace {

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

/// How closely a range names a type: 0 not at all, 1 by */*, 2 by type/*, 3 exactly.
int closeness(std::string_view range, std::string_view type) {
  if (range == "*/*" || range == "*") return 1;
  if (equals_ignoring_case(range, type)) return 3;
  const auto slash = type.find('/');
  return range.ends_with("/*") && equals_ignoring_case(range.substr(0, range.size() - 2), type.substr(0, slash)) ? 2
                                                                                                                 : 0;
}

double liking(const std::vector<MediaRange>& ranges, std::string_view type) {
  int closest = 0;
  double quality = 0;
  for (const auto& range : ranges) {
    const int close = closeness(range.type, type);
    if (close > closest) {
      closest = close;
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
  double most = 0;
  for (std::size_t i = 0; i < offered.size(); ++i) {
    const double liked = liking(ranges, offered[i]);
    if (liked > most) {
      most = liked;
      best = i;
    }
  }
  return best;
}

}  // namespace creased
