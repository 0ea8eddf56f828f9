#include "server/jobs/needs.h"

#include <algorithm>

namespace creased {
namespace {

// Measured, as address space, on closed and open meshes, on vertices without faces and faces without neighbours, of ten
// thousand to a million faces: the program takes 28 MiB; the automatic setting 1.2 kB for a vertex and 2.6 kB for one
// with two faces and three edges, the sampler and the classical methods 0.3 and 1.5 kB. Half as much again is the
// margin.
constexpr std::uint64_t kProgramMemory = 48U << 20U, kThreadMemory = 2U << 20U, kUploadCopies = 3;
constexpr std::uint64_t kMemoryPerSweep = 512;
struct SiteMemory {
  std::uint64_t vertex, face, edge;
};
constexpr SiteMemory kAutomaticMemory{1800, 420, 350}, kSamplerMemory{600, 360, 300};
// Measured: results have up to 72 bytes for a vertex, 16 for a face and 28 for an edge; checkpoints of the sampler up
// to 120, 60 and 16; a record of a sweep 130. As text, numbers need three times as much.
constexpr std::uint64_t kFilePerSite = 512, kFilePerSweep = 1024, kFileForm = 1U << 20U;
constexpr std::uint64_t kResultPerVertex = 72, kResultPerFace = 16, kResultPerEdge = 28, kReportPerSweep = 200;
constexpr std::uint64_t kSamplerPerVertex = 120, kSamplerPerFace = 60, kSamplerPerEdge = 16;
// The mesh file that is downloaded by default.
constexpr std::uint64_t kMeshPerVertex = 64, kMeshPerFace = 16, kMeshPerEdge = 32;
constexpr std::uint64_t kDiskForm = 64 * 1024;
// Checkpoints of the automatic method have each of its solves: those of the whole mesh, nine of a scan, and one for
// each setting that it tries, on patches or on a mesh that is not larger.
constexpr std::uint64_t kSolvePerVertex = 32, kWholeSolves = 11, kTrials = 28, kMostTrialVertices = 24'000;
constexpr std::uint64_t kSitesPerMs = 1'000;   // visits of a vertex or an edge
constexpr std::uint64_t kBytesPerMs = 20'000;  // that a confined process reads and checks, or reads and writes
constexpr std::uint64_t kLeastSweeps = 50;     // what a solver without sweeps is worth

std::uint64_t solves_bytes(std::uint64_t vertices) {
  return kSolvePerVertex * (kWholeSolves * vertices + kTrials * std::min(vertices, kMostTrialVertices));
}

std::uint64_t memory_of(const crease::v1::InputFacts& input, const crease::v1::Parameters& parameters) {
  const bool automatic = parameters.method() == "mrf" && parameters.solver() == "descent";
  const SiteMemory& each = automatic ? kAutomaticMemory : kSamplerMemory;
  return kProgramMemory + std::max(1U, parameters.threads()) * kThreadMemory + input.bytes() * kUploadCopies +
         input.vertices() * each.vertex + input.faces() * each.face + input.edges() * each.edge;
}

}  // namespace

Needs needs_of(const crease::v1::InputFacts& input, const crease::v1::Parameters& parameters) {
  const std::uint64_t sweeps = parameters.sweeps();
  const std::uint64_t vertices = input.vertices(), faces = input.faces(), edges = input.edges();
  const std::uint64_t sites = vertices + faces + edges;
  Needs needs;
  const std::uint64_t solves = solves_bytes(vertices);
  const std::uint64_t sampler = vertices * kSamplerPerVertex + faces * kSamplerPerFace + edges * kSamplerPerEdge;
  const std::uint64_t result = vertices * kResultPerVertex + faces * kResultPerFace + edges * kResultPerEdge;
  const std::uint64_t mesh = vertices * kMeshPerVertex + faces * kMeshPerFace + edges * kMeshPerEdge;
  needs.memory_bytes = memory_of(input, parameters) + sweeps * kMemoryPerSweep;
  needs.file_bytes = kFileForm + sites * kFilePerSite + solves + sweeps * kFilePerSweep;
  needs.encoded_bytes = kFileForm + sites * kFilePerSite + sweeps * kFilePerSweep;
  needs.disk_bytes = kDiskForm + result + 2 * std::max(sampler, solves) + mesh + sweeps * kReportPerSweep;
  needs.work = std::chrono::milliseconds((vertices + edges) * std::max(sweeps, kLeastSweeps) / kSitesPerMs);
  return needs;
}

std::chrono::milliseconds reading_time(std::uint64_t bytes) { return std::chrono::milliseconds(bytes / kBytesPerMs); }

}  // namespace creased
