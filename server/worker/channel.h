#pragma once

#include <google/protobuf/message_lite.h>

#include <chrono>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "server/store/durable_file.h"

namespace creased {

/// Messages, with descriptors where there are some, over a socket that keeps their boundaries.

/// Two connected ends. \throw crease::Error internal
std::pair<Descriptor, Descriptor> make_channel();

/// False: nobody reads any more.
bool send_message(int channel, const google::protobuf::MessageLite& message, std::span<const int> files = {});

enum class Receipt { kMessage, kNothing, kEnded };

/// Waits for a message until `deadline`, or as long as it takes. kNothing: none came in time; kEnded also for what is
/// no such message. `files` gets the descriptors that came with it; without it there must be none.
Receipt receive_message(int channel, google::protobuf::MessageLite& message,
                        std::optional<std::chrono::steady_clock::time_point> deadline = std::nullopt,
                        std::vector<Descriptor>* files = nullptr);

}  // namespace creased
