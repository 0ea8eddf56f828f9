#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "server/base/durable_file.h"
#include "server/transport/guarded_server.h"

namespace creased {

/// A file and how to serve it.
struct Download {
  std::shared_ptr<const OpenFile> file;
  std::string media_type;
  std::string etag;         ///< strong, without quotes; empty when the content may change
  std::string disposition;  ///< Content-Disposition header; empty for none
};

/// Answers with the file, with the requested range of it, or with 304 when the client's copy is current [RFC 9110].
/// Requests for several ranges, and malformed ranges, get the whole file.
/// \throw crease::Error range_not_satisfiable, after setting Content-Range
void send_file(const Exchange& exchange, httplib::Response& response, const Download& download);

}  // namespace creased
