#pragma once

#include <string>

namespace creased {

/// Waits until the server of a database answers, and prepares its tables. The wait has no end of its own. Meanwhile
/// SIGTERM and SIGINT, even when they are blocked, end the process with code 0: nothing has begun that would have to be
/// ended in order. To be called before the process starts threads.
/// \throw Error store_unavailable when waiting does not help: there is no such database, role or password, the address
/// is none, the tables cannot be made or are too new
void await_tables(const std::string& url);

}  // namespace creased
