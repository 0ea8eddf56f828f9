#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "server/http/call.h"
#include "server/store/durable_file.h"

namespace creased {

/// A file that stays readable while it is open, whatever becomes of its name.
struct OpenFile {
  Descriptor descriptor;
  std::uint64_t bytes = 0;
};

/// Null: there is no such file.
std::shared_ptr<const OpenFile> open_file(const std::filesystem::path& path);

/// How a file is handed out.
struct Download {
  std::shared_ptr<const OpenFile> file;
  std::string media_type;
  std::string etag;         ///< strong, without quotes; empty: it is different the next time
  std::string disposition;  ///< Content-Disposition; empty: none
};

/// Answers with the file, or the one range of it that was asked for, or 304 when the client has it [RFC 9110].
/// Several ranges, and ranges that are malformed, are answered with the whole.
/// \throw crease::Error range_not_satisfiable, after setting Content-Range
void send_file(Call& call, const Download& download);

}  // namespace creased
