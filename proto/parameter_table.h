#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "core/options/set_option.h"
#include "crease/v1/parameters.pb.h"

namespace crease {

enum class ParameterType { kBoolean, kInteger, kNumber, kString };

/// One row of the table: a field of crease.v1.Parameters with its options.
struct ParameterInfo {
  std::string name;
  ParameterType type = ParameterType::kNumber;
  std::string unit;
  double min = 0, max = 0;          ///< integers and numbers
  std::vector<std::string> values;  ///< strings
  std::string default_text;
  std::string meaning;

  std::string expected() const;  ///< "a number from 0 to 1000", "one of quadratic, square_root", …
};

/// Every parameter in the order of the schema.
const std::vector<ParameterInfo>& parameter_table();
std::vector<std::string> parameter_names();

/// Sets one parameter from text, as in a query or after -p.
/// \throw Error parameter_unknown, parameter_invalid, parameter_out_of_range
void set_parameter(v1::Parameters& parameters, std::string_view name, std::string_view text);

/// Reads a JSON object of parameters; a number in a string is not a number.
/// \throw Error as set_parameter; json_invalid is the caller's
v1::Parameters parameters_from_json(const nlohmann::json& object);

/// Refuses what a message from outside holds out of range, and fields that are not in the schema.
/// \throw Error as set_parameter
void validate(const v1::Parameters& parameters);

/// Every field set: given values, defaults for the others, and `auto` and 0 threads replaced by what they stand for.
v1::Parameters resolve(const v1::Parameters& parameters);

/// The options of core that resolved parameters stand for.
SmoothOptions to_options(const v1::Parameters& resolved);

/// JSON Schema (2020-12) of the parameters, with unit and range, as GET /v1/parameters answers.
nlohmann::ordered_json parameters_schema();

/// Whether a parameter can change the result (threads cannot); the others go into the mesh file's extras.
bool changes_result(std::string_view name);

/// Whether a parameter is about the service's care for the job, not about smoothing: core has no such option.
bool is_of_service(std::string_view name);

}  // namespace crease
