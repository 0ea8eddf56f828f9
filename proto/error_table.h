#pragma once

#include <span>
#include <string_view>

#include "core/error.h"
#include "crease/v1/job.pb.h"

namespace crease {

/// One kind of error: its stable code, HTTP status and title.
struct ErrorKind {
  std::string_view code;
  int status;
  std::string_view title;
};

/// All errors of the API and the command line, ordered by code.
std::span<const ErrorKind> error_table();

/// The row of a code, or the row of `internal` when the table has no such code.
const ErrorKind& error_kind(std::string_view code);

/// The problem document of an error.
v1::Problem to_problem(const Error& error);
/// The error of a problem document.
Error to_error(const v1::Problem& problem);

}  // namespace crease
