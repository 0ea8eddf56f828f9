#pragma once

#include <string>
#include <string_view>

namespace creased {

/// First line of a checkpoint file, with the program's version and a hash of the state, which follows. It shows whether
/// the file is complete and comes from the same version.
std::string checkpoint_head(std::string_view state);

/// The state in the bytes of a checkpoint file. \throw crease::CheckpointError
std::string_view open_checkpoint(std::string_view bytes);

}  // namespace creased
