#include "core/energy/smoothness.h"

namespace crease {
namespace {}  // namespace

SmoothnessTerm::SmoothnessTerm(const TermSetup& setup)
    : shape_(setup.options.smoothness),
      width_(static_cast<float>(2 * std::sin(setup.options.smoothness_width / 2))),
      kept_(setup.field.topology.edges.size() + 1, 0) {}

double SmoothnessTerm::energy(const Field& field, ThreadTeam& team) const {
  return block_sum<double>(field.labels.size(), team,
                           [&](std::size_t e) { return (1 - field.labels[e]) * rho(field.edges.chord[e]).value; });
}

void SmoothnessTerm::labels_changed(const Field& field, ThreadTeam& team) {
  team.run(field.labels.size(), kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t e = begin; e < end; ++e) {
      kept_[e] = field.topology.is_interior(e) ? static_cast<float>(1 - field.labels[e]) : 0;
    }
  });
}

}  // namespace crease
