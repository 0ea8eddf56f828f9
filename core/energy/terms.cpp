#include "core/energy/terms.h"

#include <type_traits>

namespace crease {

Neighborhood EnergyTerms::neighborhood(const MrfOptions& options) {
  bool wide = false;
  const auto look = [&]<typename Term>(std::type_identity<Term>) {
    if constexpr (requires { Term::neighborhood(options); }) {
      wide = wide || (is_used<Term>(options) && Term::neighborhood(options) == Neighborhood::kWide);
    }
  };
  [&]<typename... Terms>(std::type_identity<std::tuple<Terms...>>) {
    (look(std::type_identity<Terms>{}), ...);
  }(std::type_identity<TermTable>{});
  return wide ? Neighborhood::kWide : Neighborhood::kFirstOrder;
}

}  // namespace crease
