#pragma once

#include <span>
#include <string_view>

#include "core/error.h"
#include "crease/v1/job.pb.h"
#include "proto/exit_code.h"

namespace crease {

/// One kind of error, as the API and the command line show it. The table stands here, because core knows nothing of
/// either, and both sides use it.
struct ErrorKind {
  ErrorCode code;
  std::string_view name;   ///< `code` of a problem document
  int status;              ///< HTTP status; 0 for errors that only the command line has
  std::string_view title;  ///< of the problem document
  int retry_after_s;       ///< when the same call may succeed; 0 if only another call can
  ExitCode exit_code;      ///< of the command line
};

/// All kinds of errors, ordered by code and by name.
std::span<const ErrorKind> error_table();

const ErrorKind& error_kind(ErrorCode code);

/// The row with this name, or null.
const ErrorKind* find_error_kind(std::string_view name);

/// The problem document of an error.
v1::Problem to_problem(const Error& error);
/// The error of a problem document; code `internal` when the table has no row with its name.
Error to_error(const v1::Problem& problem);

}  // namespace crease
