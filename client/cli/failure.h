#pragma once

#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <string_view>

#include "client/cli/exit_code.h"
#include "core/error.h"

namespace crease::client {

/// Why a command did not succeed, as a problem document: the service's own, or one made here.
class Failure : public std::runtime_error {
 public:
  /// Of this client alone.
  Failure(std::string_view code, const std::string& detail);
  /// What core refuses, as the service would put it.
  explicit Failure(const Error& error);
  /// What the service answered.
  explicit Failure(const nlohmann::ordered_json& problem);
  Failure(nlohmann::ordered_json problem, ExitCode exit_code);

  const nlohmann::ordered_json& problem() const { return problem_; }
  ExitCode exit_code() const { return exit_code_; }

 private:
  nlohmann::ordered_json problem_;
  ExitCode exit_code_;
};

}  // namespace crease::client
