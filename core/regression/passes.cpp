#include "core/regression/passes.h"

#include <array>

#include "core/regression/face_turning.h"
#include "core/regression/normal_network.h"
#include "core/regression/normal_regression.h"

namespace crease {

Turned turned_in_passes(const FlatMesh& mesh, const FlatVectors& positions, std::span<const float> reference,
                        const DescentSight& sight, float amount, std::span<const float> precisions, std::size_t passes,
                        ThreadTeam& team, const std::function<void()>& on_step) {
  constexpr std::array<const NormalNetwork*, kPasses> kNetworks{&kFirstNormalNetwork, &kSecondNormalNetwork};
  Turned now{positions, reference.empty() ? FlatVectors() : face_normals(mesh, reference, team)};
  for (std::size_t pass = 0; pass < passes; ++pass) {
    on_step();
    now.normals = regressed_normals(*kNetworks[pass], mesh, now.positions, now.normals, sight, amount, team);
    on_step();
    now.positions = turned_towards(mesh, now.positions, now.normals, precisions, team);
  }
  return now;
}

}  // namespace crease
