#include "core/options/options.h"

#include <stdexcept>
#include <utility>

namespace crease {
namespace {

template <std::size_t... kIndices>
Method made(std::size_t index, std::index_sequence<kIndices...> /*all*/) {
  Method method;
  const bool known = ((index == kIndices && (method.emplace<kIndices>(), true)) || ...);
  if (!known) throw std::out_of_range("there is no such method");
  return method;
}

}  // namespace

Method default_method(std::size_t index) {
  return made(index, std::make_index_sequence<std::variant_size_v<Method>>());
}

}  // namespace crease
