#pragma once

#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

namespace crease::fuzz {

/// A property that the code under test has broken.
class Violation : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

inline void require(bool holds, std::string_view property) {
  if (!holds) throw Violation(std::string(property));
}

/// What one fuzzer does with its bytes. libFuzzer and the unit test that replays the corpora run the same.
struct Target {
  std::string_view name;  ///< of its folders under corpus/ and regressions/, too
  /// \throw Violation; whatever else escapes is a fault as well
  void (*run)(std::string_view bytes);
};

std::span<const Target> targets();

/// Null: there is none of that name.
const Target* find_target(std::string_view name);

}  // namespace crease::fuzz
