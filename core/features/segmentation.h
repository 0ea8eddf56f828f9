#pragma once

#include <array>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include "core/base/thread_team.h"
#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease {

/// Lengths are in mean edge lengths and areas in mean face areas. Weights are relative to a border along a flat edge.
struct SegmentOptions {
  double ridge_weight = 0.5;                          ///< τ, per label: cost of a ridge inside a segment
  double bend_scale = 30 * (std::numbers::pi / 180);  ///< φ₁, radians: a border there costs 1/e of a flat one
  double small_weight = 10;                           ///< μ: cost of a segment without area
  double small_area = 20;         ///< a₀ in mean face areas: segments of at least this area cost nothing
  double small_fraction = 0.005;  ///< a₀ is at most this fraction of the whole surface
  std::uint32_t gap_rings = 4;    ///< limit of d_e − 1 and of the watershed's distance
  std::uint32_t sweeps = 6;       ///< limit; expansions usually settle earlier
};

/// The segments of a mesh as a Markov random field (§5). Sites are the faces, labels s their segments, and
///
///     E(s) = Σ_e l_e (d_e (1 − ε_e) exp(−(φ_e/φ₁)²) [s_i ≠ s_j] + τ ε_e [s_i = s_j])
///            + μ Σ_S max(0, 1 − area(S)/a₀)
///
/// over the interior edges e between faces i and j, with lengths l, ridge labels ε and dihedral angles φ; d is 1 at
/// ridges and grows by one with each ring of vertices away from them; S are the segments. The first sum is a
/// correlation clustering [Bansal, Blum & Chawla 2004]. It needs neither the number of segments nor a model of them, so
/// that a curved patch is one segment just as a plane is. A border along a ridge may cross a gap if the gap costs less
/// than τ times the length of the ridge; the cost of a flat gap grows with the square of its length. A border around a
/// stray ridge edge does not pay. The second sum is a label cost [Delong et al. 2012] for small segments. Segments do
/// not cross boundaries or non-manifold edges.
class SegmentField {
 public:
  /// `dihedral_rad` are the signed angles of the edges. `topology` and `labels` must outlive the field.
  SegmentField(const Mesh& mesh, const Topology& topology, const std::vector<Vec3>& positions,
               const std::vector<double>& labels, const std::vector<double>& dihedral_rad,
               const SegmentOptions& options = {}, ThreadTeam& team = calling_thread());

  const Topology& topology() const { return topology_; }
  const SegmentOptions& options() const { return options_; }
  std::size_t face_count() const { return area_.size(); }
  /// The face across the interior edge number k of a face; kNone where there is none.
  const std::array<Index, 3>& neighbors(Index face) const { return neighbors_[face]; }
  bool is_ridge(Index edge) const { return crease::is_ridge(labels_[edge]); }
  /// The energy of a border along the edge minus the energy without one; negative where a border pays. 0 for edges that
  /// are not interior.
  double border_cost(Index edge) const { return border_cost_[edge]; }
  /// The area in mean face areas, at least 0.1.
  double area(Index face) const { return area_[face]; }
  /// The label cost of a segment with this area.
  double smallness(double segment_area) const;

  /// Rings of vertices between the vertex and the nearest ridge, at most `gap_rings`.
  std::uint32_t rings_from_ridges(Index vertex) const { return rings_[vertex]; }

  double energy(std::span<const Index> segments) const;

 private:
  const Topology& topology_;
  const std::vector<double>& labels_;
  SegmentOptions options_;
  std::vector<double> border_cost_, area_;
  std::vector<std::array<Index, 3>> neighbors_;
  std::vector<std::uint32_t> rings_;  ///< per vertex
  double unsegmented_ = 0;            ///< Σ l τ ε: the energy of a single segment without its label cost
  double small_area_ = 0;
};

struct Segmentation {
  std::vector<Index> segments;  ///< per face; numbered from 0 in the order of their first faces
  Index count = 0;
  std::vector<double> energies;  ///< at the start, after merging, and after each sweep
};

/// Segments the faces twice and returns the result with less energy. One run starts from a watershed of the distance
/// from ridges, which is best if ridges are complete. The other starts from single faces near ridges, which is best if
/// ridges have many gaps and much noise. Each run merges pairs of neighbours as long as that lowers the energy, then
/// does sweeps of local α-expansions and merges. Every segment is connected across interior edges.
///
/// An expansion looks only at the faces within a few steps of the segment's border. A sweep therefore takes time in
/// proportion to the borders, not to faces times segments. No cut can represent all pairs of the true energy, so each
/// cut minimises an upper bound that is exact at the current segments. The energy never rises.
///
/// The two runs are at the same time on two threads of the team; the result is the same.
Segmentation segment_faces(const SegmentField& field, ThreadTeam& team = calling_thread());
Segmentation segment_faces(const Mesh& mesh, const Topology& topology, const std::vector<Vec3>& positions,
                           const std::vector<double>& labels, const SegmentOptions& options = {},
                           ThreadTeam& team = calling_thread());

}  // namespace crease
