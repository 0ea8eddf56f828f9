#pragma once

#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

namespace crease::fuzz {

/// Thrown when the code under test breaks a property.
class Violation : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

inline void require(bool holds, std::string_view property) {
  if (!holds) throw Violation(std::string(property));
}

/// A fuzzer: what to do with the bytes. libFuzzer runs it, and so does the unit test that replays the corpora.
struct Target {
  std::string_view name;  ///< also of its folders in corpus/ and regressions/, and of its file in dictionaries/
  /// \throw Violation; any other exception is a fault, too
  void (*run)(std::string_view bytes);
};

/// Every fuzzer, from the one table of them.
std::span<const Target> targets();

/// Returns null when there is no target with this name.
const Target* find_target(std::string_view name);

}  // namespace crease::fuzz
