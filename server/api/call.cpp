#include "server/api/call.h"

#include <charconv>

namespace creased {

std::string Call::query(const std::string& name, const std::string& fallback) const {
  if (name == "format" && !format.empty()) return format;
  const auto found = request.params.find(name);
  return found == request.params.end() ? fallback : found->second;
}

double Call::query_number(const std::string& name, double fallback) const {
  const std::string text = query(name);
  std::from_chars(text.data(), text.data() + text.size(), fallback);
  return fallback;
}

}  // namespace creased
