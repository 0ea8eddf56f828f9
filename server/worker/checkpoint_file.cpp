#include "server/worker/checkpoint_file.h"

#include <fmt/format.h>

#include "core/base/state_archive.h"
#include "proto/convert.h"

namespace creased {

std::string checkpoint_head(std::string_view state) {
  return fmt::format("creased checkpoint {} {}\n", CREASE_VERSION, crease::sha256_hex(state));
}

std::string_view open_checkpoint(std::string_view bytes) {
  const auto end = bytes.find('\n');
  if (end == std::string_view::npos) throw crease::CheckpointError("the checkpoint has no first line");
  const std::string_view state = bytes.substr(end + 1);
  if (bytes.substr(0, end + 1) != checkpoint_head(state)) {
    throw crease::CheckpointError("the checkpoint is damaged or was written by another version");
  }
  return state;
}

}  // namespace creased
