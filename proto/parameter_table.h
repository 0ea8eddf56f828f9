#pragma once

#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "core/options/parameters.h"
#include "crease/v1/parameters.pb.h"

namespace crease {

/// Sets one parameter from text, as in a query or after -p.
/// \throw Error parameter_unknown, parameter_invalid, parameter_out_of_range
void set_parameter(v1::Parameters& parameters, std::string_view name, std::string_view text);

/// Reads a JSON object of parameters; a number in a string is not a number.
/// \throw Error as set_parameter; json_invalid is the caller's
v1::Parameters parameters_from_json(const nlohmann::json& object);

/// Refuses values that are out of range in a message from outside, and fields that are not in the schema.
/// \throw Error as set_parameter
void validate(const v1::Parameters& parameters);

/// The parameters that matter for the method and the choices of the given ones, each set: to the given value, or to
/// the default. For each that was given and does not matter, a warning parameter_not_used is added to `warnings`.
/// \throw Error parameter_out_of_range where the method does not take a value that others do
v1::Parameters resolve(const v1::Parameters& given, std::vector<Warning>* warnings = nullptr);

/// The options that the parameters stand for.
SmoothOptions to_options(const v1::Parameters& parameters);

/// Where the operator of a service has other defaults and maxima than the table: in the fields that are set.
struct OperatorSettings {
  v1::Parameters defaults, maxima;
};

/// JSON Schema (2020-12) of the parameters, as GET /v1/parameters returns it. Each has its type, range, default and
/// meaning, and besides: x-group; x-unit; x-applies, the words of other parameters that it matters with, all of them
/// together; x-defaults and x-ranges by method, where methods differ.
nlohmann::ordered_json parameters_schema(const OperatorSettings& settings = {});

}  // namespace crease
