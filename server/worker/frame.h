#pragma once

#include <google/protobuf/message_lite.h>

#include <chrono>
#include <optional>

namespace creased {

/// Messages over a socket or pipe: four bytes of length, least significant first, then the message.

/// False: nobody reads any more.
bool write_frame(int descriptor, const google::protobuf::MessageLite& message);

enum class FrameOutcome { kRead, kEnded, kTimedOut };

/// Reads one message, by `deadline` if there is one. kEnded also for what is no message or over 16 MiB.
FrameOutcome read_frame(int descriptor, google::protobuf::MessageLite& message,
                        std::optional<std::chrono::steady_clock::time_point> deadline = std::nullopt);

}  // namespace creased
