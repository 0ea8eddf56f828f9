#pragma once

#include <string>
#include <string_view>

namespace creased {

/// A checkpoint as a file: a line with the program's version and a hash, so that one that is torn, or of another
/// program, is told from a good one; then the state.
std::string checkpoint_head(std::string_view state);

/// The state in a checkpoint's bytes. \throw crease::CheckpointError
std::string_view open_checkpoint(std::string_view bytes);

}  // namespace creased
