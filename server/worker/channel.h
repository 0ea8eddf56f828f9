#pragma once

#include <google/protobuf/message_lite.h>

#include <chrono>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "server/base/durable_file.h"

namespace creased {

// Messages, with optional file descriptors, over a socket that keeps their boundaries.

/// Makes two connected ends. \throw crease::Error process_unavailable
std::pair<Descriptor, Descriptor> make_channel();

/// Returns false when the other end is closed.
bool send_message(int channel, const google::protobuf::MessageLite& message, std::span<const int> files = {});

enum class Receipt { kMessage, kNothing, kEnded };

/// Waits for a message until `deadline`, or without a limit. Returns kNothing when none came in time, and kEnded when
/// the other end is closed or sent something else. `files` receives the descriptors of the message; when it is null,
/// there must be none.
Receipt receive_message(int channel, google::protobuf::MessageLite& message,
                        std::optional<std::chrono::steady_clock::time_point> deadline = std::nullopt,
                        std::vector<Descriptor>* files = nullptr);

}  // namespace creased
