#include "server/jobs/needs.h"

#include <algorithm>

namespace creased {
namespace {

// Measured: results have up to 48 bytes for a vertex, 16 for a face and 28 for an edge; checkpoints up to 120, 60 and
// 16; a record of a sweep 130. As text, numbers need three times as much.
constexpr std::uint64_t kFilePerSite = 512, kFilePerSweep = 1024, kFileForm = 1U << 20U;
constexpr std::uint64_t kDiskPerVertex = 250, kDiskPerFace = 150, kDiskPerEdge = 100, kDiskPerSweep = 200,
                        kDiskForm = 64 * 1024;
constexpr std::uint64_t kSitesPerMs = 1'000;  // visits of a vertex or an edge
constexpr std::uint64_t kLeastSweeps = 50;    // what a solver without sweeps is worth

}  // namespace

Needs needs_of(const crease::v1::InputFacts& input, std::uint32_t sweeps) {
  const std::uint64_t vertices = input.vertices(), faces = input.faces(), edges = input.edges();
  const std::uint64_t sites = vertices + faces + edges;
  Needs needs;
  needs.file_bytes = kFileForm + sites * kFilePerSite + sweeps * kFilePerSweep;
  needs.disk_bytes =
      kDiskForm + vertices * kDiskPerVertex + faces * kDiskPerFace + edges * kDiskPerEdge + sweeps * kDiskPerSweep;
  needs.work =
      std::chrono::milliseconds((vertices + edges) * std::max<std::uint64_t>(sweeps, kLeastSweeps) / kSitesPerMs);
  return needs;
}

}  // namespace creased
