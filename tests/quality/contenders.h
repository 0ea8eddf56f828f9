#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "tests/quality/scores.h"

namespace crease::quality {

/// A method in the table, under the name that it was asked for.
struct Contender {
  std::string name;
  std::function<Denoised(const Pair&, const Topology&)> denoise;
};

/// One of
///   noisy                   the measured mesh as it is
///   default                 method=mrf, no other parameter
///   name=value,…            parameters as the command line takes them
///   bilateral, guided       the yardsticks with their defaults
///   bilateral-best, guided-best   the same, searched per pair against the original, which no user can do
/// `threads` is for core. \throw Error for unknown parameters, std::invalid_argument for an unknown name
Contender find_contender(const std::string& name, std::uint32_t threads);

}  // namespace crease::quality
