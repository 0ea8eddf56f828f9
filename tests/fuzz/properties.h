#pragma once

#include <string>
#include <string_view>

#include "core/error.h"
#include "core/mesh/mesh.h"

/// Properties that more than one target asks for; each \throw Violation.
namespace crease::fuzz {

/// A refusal says what it is in UTF-8, with a code that the table of errors has and no fault of ours.
void require_proper(const Error& error);

/// Finite coordinates, indices in range, at least one face.
void require_sound(const Mesh& mesh);

void require_utf8(std::string_view text, std::string_view what);

/// Runs `work` and returns whether it refused; a refusal must be proper.
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
