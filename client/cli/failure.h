#pragma once

#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <string_view>

#include "core/error.h"
#include "proto/exit_code.h"

namespace crease::client {

/// Why a command failed, as a problem document, either from the service or made here.
class Failure : public std::runtime_error {
 public:
  /// A failure in the client.
  Failure(ErrorCode code, const std::string& detail);
  /// An error of core, as the service would report it.
  explicit Failure(const Error& error);
  /// A problem document from the service.
  explicit Failure(const nlohmann::ordered_json& problem);
  Failure(nlohmann::ordered_json problem, ExitCode exit_code);

  const nlohmann::ordered_json& problem() const { return problem_; }
  ExitCode exit_code() const { return exit_code_; }

 private:
  nlohmann::ordered_json problem_;
  ExitCode exit_code_;
};

}  // namespace crease::client
