#pragma once

#include <string>
#include <string_view>

#include "core/error.h"
#include "core/mesh/mesh.h"

// Properties that several targets check. All throw Violation.
namespace crease::fuzz {

/// An error must have valid UTF-8 and a code in the table of errors that is not a server error.
void require_proper(const Error& error);

/// A mesh must have finite coordinates, indices in range and at least one face.
void require_sound(const Mesh& mesh);

void require_utf8(std::string_view text, std::string_view what);

/// Runs `work` and returns whether it refused its input. Checks the error, if any.
template <typename Work>
bool refused(const Work& work) {
  try {
    work();
    return false;
  } catch (const Error& error) {
    require_proper(error);
    return true;
  }
}

}  // namespace crease::fuzz
