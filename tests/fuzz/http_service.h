#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "server/transport/guarded_server.h"

namespace crease::fuzz {

/// What the server did with everything that a client sent on one connection.
struct Conversation {
  std::vector<creased::ExchangeSummary> exchanges;  ///< in order; refused heads have no method
  std::string answers;                              ///< all bytes that the server sent
};

/// Serves a client that sends `bytes` on one connection and then closes its end. The service runs in this process. It
/// has one finished job and neither inspects uploads nor runs jobs.
Conversation converse(std::string_view bytes);

/// The id of the finished job. `converse` creates the job again after a DELETE.
inline constexpr std::string_view kFinishedJob = "f1e2d3c4b5a697887960";

}  // namespace crease::fuzz
