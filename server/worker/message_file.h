#pragma once

#include <google/protobuf/message_lite.h>

#include <filesystem>
#include <string_view>

namespace creased {

/// Writes `message` straight into a file that appears whole or not at all; see ReplacingFile.
/// \throw Error store_unavailable
void write_message(const std::filesystem::path& path, std::string_view suffix,
                   const google::protobuf::MessageLite& message, bool durable);

}  // namespace creased
