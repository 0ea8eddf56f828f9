#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "server/http/guarded_server.h"

namespace crease::fuzz {

/// What came of all that a client sent on one connection.
struct Conversation {
  std::vector<creased::ExchangeSummary> exchanges;  ///< in their order; refused heads have no method
  std::string answers;                              ///< all bytes that came back
};

/// Has the server of creased answer a client that sends `bytes` on one connection and then closes its end. The service
/// lives in this process, with one finished job and nobody who inspects uploads or runs jobs.
Conversation converse(std::string_view bytes);

/// The id of the finished job; `converse` makes it anew after a DELETE.
inline constexpr std::string_view kFinishedJob = "f1e2d3c4b5a697887960";

}  // namespace crease::fuzz
