#pragma once

#include <span>

#include "core/measure/measure.h"
#include "core/smooth/field.h"

namespace crease::test {

/// A field in general position: vertices shaken by up to a tenth of an edge, labels anywhere in [0, 1].
Field shaken_field(const Mesh& mesh, const Topology& topology, unsigned seed, const MrfOptions& options = {},
                   std::span<const double> weights = {});

/// What smoothing makes of `noisy`, against the original.
Measurement measure_smoothed(const Mesh& noisy, const Mesh& original, const MrfOptions& options);

}  // namespace crease::test
