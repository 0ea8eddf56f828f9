#pragma once

#include <span>
#include <string_view>

#include "core/error.h"
#include "crease/v1/job.pb.h"

namespace crease {

/// One kind of refusal: stable code, HTTP status, title.
struct ErrorKind {
  std::string_view code;
  int status;
  std::string_view title;
};

/// The one table of errors, ordered by code.
std::span<const ErrorKind> error_table();

/// The row of a code; that of `internal` for a code that is not in the table.
const ErrorKind& error_kind(std::string_view code);

/// The problem document of an error.
v1::Problem to_problem(const Error& error);

}  // namespace crease
