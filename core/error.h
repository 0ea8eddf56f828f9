#pragma once

#include <array>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

namespace crease {

/// Stable codes of everything that core refuses. Their HTTP status and title are in proto/error_table.cpp.
namespace code {
inline constexpr std::string_view kMeshFormatUnknown = "mesh_format_unknown";
inline constexpr std::string_view kMeshEmpty = "mesh_empty";
inline constexpr std::string_view kMeshTruncated = "mesh_truncated";
inline constexpr std::string_view kMeshSyntax = "mesh_syntax";
inline constexpr std::string_view kMeshCountMismatch = "mesh_count_mismatch";
inline constexpr std::string_view kMeshIndexOutOfRange = "mesh_index_out_of_range";
inline constexpr std::string_view kMeshNotFinite = "mesh_not_finite";
inline constexpr std::string_view kMeshNoFaces = "mesh_no_faces";
inline constexpr std::string_view kMeshTooLarge = "mesh_too_large";
inline constexpr std::string_view kMeshUnsupported = "mesh_unsupported";
inline constexpr std::string_view kMeshNoExtent = "mesh_no_extent";
inline constexpr std::string_view kMeshMismatch = "mesh_mismatch";
inline constexpr std::string_view kWeightsInvalid = "weights_invalid";
inline constexpr std::string_view kOutputFormatUnknown = "output_format_unknown";
inline constexpr std::string_view kParameterUnknown = "parameter_unknown";
inline constexpr std::string_view kParameterInvalid = "parameter_invalid";
inline constexpr std::string_view kParameterOutOfRange = "parameter_out_of_range";

/// All of the above.
inline constexpr std::array kAllCodes = {
    kMeshFormatUnknown,   kMeshEmpty,          kMeshTruncated,  kMeshSyntax,          kMeshCountMismatch,
    kMeshIndexOutOfRange, kMeshNotFinite,      kMeshNoFaces,    kMeshTooLarge,        kMeshUnsupported,
    kMeshNoExtent,        kMeshMismatch,       kWeightsInvalid, kOutputFormatUnknown, kParameterUnknown,
    kParameterInvalid,    kParameterOutOfRange};
}  // namespace code

/// A refusal: a stable code, a sentence for people, and where the fault lies ("line 12", "byte 84", "face 3").
/// `field`, `value` and `expected` are set for faults of a named parameter or an array's item.
class Error : public std::runtime_error {
 public:
  Error(std::string_view code, const std::string& detail, std::string place = {})
      : std::runtime_error(detail), code_(code), place_(std::move(place)) {}

  static Error parameter(std::string_view code, std::string field, std::string value, std::string expected,
                         std::string place = {}) {
    Error error(code, "parameter '" + field + "' is '" + value + "', expected " + expected, std::move(place));
    error.field_ = std::move(field);
    error.value_ = std::move(value);
    error.expected_ = std::move(expected);
    return error;
  }

  std::string_view code() const { return code_; }
  std::string detail() const { return what(); }
  const std::string& place() const { return place_; }
  const std::string& field() const { return field_; }
  const std::string& value() const { return value_; }
  const std::string& expected() const { return expected_; }

 private:
  std::string code_;
  std::string place_;
  std::string field_, value_, expected_;
};

/// Something the user should know of an input that was nevertheless accepted.
struct Warning {
  std::string code;
  std::string detail;
};

}  // namespace crease
