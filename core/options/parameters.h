#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/error.h"
#include "core/options/options.h"

namespace crease {

/// A value as users write it: angles in degrees, choices as words.
using ParameterValue = std::variant<bool, std::uint32_t, double, std::string>;

/// Values by the names of their parameters.
using ParameterValues = std::map<std::string, ParameterValue, std::less<>>;

enum class ParameterType { kBoolean, kInteger, kNumber, kWord };

/// A member of the options that a parameter is bound to.
struct ParameterPlace {
  std::optional<std::size_t> method =
      {};  ///< whose options the member is in, by its index in Method; none: every method
  ParameterType type = ParameterType::kNumber;
  std::vector<std::string_view> words = {};  ///< of a choice
  ParameterValue (*get)(const JobOptions&) = nullptr;
  void (*set)(JobOptions&, const ParameterValue&) = nullptr;
  double min = 0, max = 0;  ///< both included; of integers and numbers
};

/// A parameter matters only where another one has one of these words.
struct ParameterCondition {
  std::string_view parameter;
  std::vector<std::string_view> words;
};

/// A value that leaves the choice to the program.
struct AutomaticValue {
  std::string_view text;  ///< empty: there is none
  /// What it stands for beside the values that were given; null: the default.
  ParameterValue (*choose)(const ParameterValues& given) = nullptr;
};

/// One row of the table. Everything that is said about a parameter, and all that is done with one, comes from its row.
struct Parameter {
  std::string_view name;
  int field = 0;  ///< number in crease.v1.Parameters, for ever
  std::string_view group;
  std::string_view unit = {};  ///< empty: a pure number
  std::string_view meaning;
  std::vector<ParameterPlace> places;               ///< one for each method that has it
  std::vector<ParameterCondition> conditions = {};  ///< all of them must hold
  AutomaticValue automatic = {};
  bool changes_result = true;

  ParameterType type() const { return places.front().type; }
  /// The least and the largest value that any method takes.
  double min() const;
  double max() const;
  /// What a word may be, the automatic one first.
  std::vector<std::string_view> words() const;
  /// "a number from 0 to 1000", "one of quadratic, square_root, …".
  std::string expected() const;
  /// Where all methods that have the parameter agree.
  std::optional<ParameterValue> common_default() const;
  bool has_common_range() const;
  /// The member for `method`; null where the method has none.
  const ParameterPlace* place_for(std::size_t method) const;
};

/// Every parameter, in the order of the field numbers.
const std::vector<Parameter>& parameter_table();

/// \throw Error parameter_unknown; `value` is for its text
const Parameter& find_parameter(std::string_view name, std::string_view value = {});

/// The names of the methods, in the order of Method.
const std::vector<std::string_view>& method_names();

/// Looks for faults that the compiler cannot see: names and numbers that stand twice, conditions on nothing, defaults
/// out of range. \throw std::logic_error
void check_parameter_table();

/// What an error repeats of a value: all of it, unless it is very long.
std::string shortened(std::string_view text);

/// The default for a method that has the parameter.
ParameterValue default_value(const Parameter& parameter, const ParameterPlace& place);

/// A value as it would be typed.
std::string text_of(const ParameterValue& value);

/// Where a parameter matters: with one of the methods that have it, and where its conditions hold. Empty: always.
std::vector<ParameterCondition> conditions_of(const Parameter& parameter);

/// "method=mrf, process=face or both".
std::string text_of(const std::vector<ParameterCondition>& conditions);

/// "a number from 0 to 1".
std::string range_text(const ParameterPlace& place);

/// The whole text as a value of the parameter.
/// \throw Error parameter_invalid, parameter_out_of_range where no method takes it
ParameterValue parse_value(const Parameter& parameter, std::string_view text);

/// \throw Error as parse_value
void check_value(const Parameter& parameter, const ParameterValue& value);

/// Parameters that some were given of.
struct ResolvedParameters {
  ParameterValues values;         ///< of those that matter, no other
  JobOptions options;             ///< that they stand for
  std::vector<Warning> warnings;  ///< parameter_not_used, for each that was given in vain
};

/// Gives each parameter that matters for the method and the choices of `given` its value: the given one, or the
/// default. An automatic value is replaced by what it stands for.
/// \throw Error parameter_unknown, parameter_invalid, parameter_out_of_range
ResolvedParameters resolve_parameters(const ParameterValues& given);

/// The values of the parameters that matter for these options: what resolves to them.
ParameterValues values_of(const JobOptions& options);

}  // namespace crease
