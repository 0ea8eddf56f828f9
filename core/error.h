#pragma once

#include <stdexcept>
#include <string>
#include <utility>

#include "core/error_code.h"

namespace crease {

/// A refusal: a stable code, a sentence for people, and where the fault lies ("line 12", "byte 84", "face 3").
/// `field`, `value` and `expected` are set for faults of a named parameter or an array's item.
class Error : public std::runtime_error {
 public:
  Error(ErrorCode code, const std::string& detail, std::string place = {})
      : std::runtime_error(detail), code_(code), place_(std::move(place)) {}

  static Error parameter(ErrorCode code, std::string field, std::string value, std::string expected,
                         std::string place = {}) {
    Error error(code, "parameter '" + field + "' is '" + value + "', expected " + expected, std::move(place));
    error.field_ = std::move(field);
    error.value_ = std::move(value);
    error.expected_ = std::move(expected);
    return error;
  }

  ErrorCode code() const { return code_; }
  std::string detail() const { return what(); }
  const std::string& place() const { return place_; }
  const std::string& field() const { return field_; }
  const std::string& value() const { return value_; }
  const std::string& expected() const { return expected_; }

 private:
  ErrorCode code_;
  std::string place_;
  std::string field_, value_, expected_;
};

/// Something the user should know of an input that was nevertheless accepted.
struct Warning {
  std::string code;
  std::string detail;
};

}  // namespace crease
