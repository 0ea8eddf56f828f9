#pragma once

#include <vector>

#include "core/choice/candidate.h"
#include "core/choice/choice.h"
#include "core/choice/first_sight.h"

namespace crease {

/// Of noise that counts as none, in ℓ².
inline constexpr double kNoVariance = 1e-8;

/// What is known of the noise and of the surface after the reference, flats, has been solved.
struct Evidence {
  FirstSight sight;
  double variance = 0;  ///< of the noise, in ℓ²; of its geometric mean where it varies
  Candidate reference;
  std::vector<float> precisions;  ///< per vertex: those given, or of noise that varies over the surface; empty for 1
  double noise_spread = 0;        ///< variance of the logarithm of the local noise variance
  bool varying = false;
  bool impulsive = false;
};

/// Solves the reference on `mesh` until it agrees with its own estimate of the noise. `precisions` per vertex, empty
/// for 1. With `leave_out_border`, vertices at borders do not count.
Evidence gather_evidence(const FlatMesh& mesh, const FirstSight& sight, std::span<const float> precisions,
                         const ChoiceOptions& options, const Solve& solve, bool leave_out_border);

/// A solve that is to be probed.
struct ProbedSolve {
  const FlatMesh& mesh;
  GraduatedOptions options;
  std::span<const float> precisions;
  double variance = 0;  ///< of the noise; the probe moves vertices by a tenth of its deviation
  std::uint32_t seed = 1;
  bool leave_out_border = false;
};

/// Solves a setting on the short schedule with what is known of the noise; its divergence stays unknown.
Candidate solve_setting(const Setting& setting, const FlatMesh& mesh, const Evidence& evidence, const Solve& solve,
                        bool leave_out_border);

/// Solves again for probed positions, and sets the divergence of the candidate, whose result is known.
void probe(Candidate& candidate, const ProbedSolve& solved, const Solve& solve);

/// Solves a setting likewise, and again for a probe.
Candidate try_setting(const Setting& setting, const FlatMesh& mesh, const Evidence& evidence,
                      const ChoiceOptions& options, const Solve& solve, bool leave_out_border);

/// The noise of the whole `mesh` where it varies, from evidence that was gathered on a part of it: returns the variance
/// and sets the precision of each vertex.
double spread_varying_noise(const FlatMesh& mesh, const Evidence& evidence, const Solve& solve,
                            std::vector<float>& precisions);

}  // namespace crease
