#pragma once

#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/mesh/topology.h"

namespace crease {

/// Lengths and areas in means over the mesh's edges and faces, weights relative to a border across a flat edge.
struct SegmentOptions {
  double ridge_weight = 0.5;  ///< τ, per label: a ridge inside a segment
  double bend_scale =
      30 * (std::numbers::pi / 180);  ///< φ₁, radians: where a border costs 1/e of one across flat edges
  double small_weight = 10;           ///< μ: a segment without area
  double small_area = 20;             ///< a₀ in mean face areas: from here on a segment costs nothing
  double small_fraction = 0.005;      ///< a₀ is never more than this part of the whole surface
  std::uint32_t gap_rings = 4;        ///< limit of d_e − 1 and of the watershed's distance
  std::uint32_t sweeps = 6;           ///< limit; expansions settle earlier
};

/// The segments of a mesh as a Markov random field (§5). Sites are the faces, labels s their segments, and
///
///     E(s) = Σ_e l_e (d_e (1 − ε_e) exp(−(φ_e/φ₁)²) [s_i ≠ s_j] + τ ε_e [s_i = s_j])
///            + μ Σ_S max(0, 1 − area(S)/a₀)
///
/// over the interior edges e between faces i and j, with lengths l, ridge labels ε and dihedral angles φ; d is 1 at
/// ridges and one more with each ring of vertices away from them; S are the segments. The first sum is a correlation
/// clustering [Bansal, Blum & Chawla 2004]: it needs no number of segments and no model of them, so that a curved patch
/// is one segment as a plane is. A border that follows a ridge may cross a gap whose cost is less than τ times the
/// ridge's length, which rises with the square of a flat gap's length; a stray ridge edge is not worth a border around
/// it. The second sum is a label cost [Delong et al. 2012] that small segments pay. Segments do not reach across
/// boundaries and non-manifold edges.
class SegmentField {
 public:
  /// `topology` and `labels` must outlive the field.
  SegmentField(const Mesh& mesh, const Topology& topology, const std::vector<Vec3>& positions,
               const std::vector<double>& labels, const SegmentOptions& options = {});

  const Topology& topology() const { return topology_; }
  const SegmentOptions& options() const { return options_; }
  std::size_t face_count() const { return area_.size(); }
  bool is_ridge(Index edge) const { return labels_[edge] >= kRidgeThreshold; }
  /// What a border along the edge costs more than none there; negative where a border pays. 0 if not interior.
  double border_cost(Index edge) const { return border_cost_[edge]; }
  /// In mean face areas, and no less than a tenth.
  double area(Index face) const { return area_[face]; }
  /// The label cost of a segment of that area.
  double smallness(double segment_area) const;

  /// Rings of vertices between the vertex and the nearest ridge, at most `gap_rings`.
  std::uint32_t rings_from_ridges(Index vertex) const { return rings_[vertex]; }

  double energy(std::span<const Index> segments) const;

 private:
  const Topology& topology_;
  const std::vector<double>& labels_;
  SegmentOptions options_;
  std::vector<double> border_cost_, area_;
  std::vector<std::uint32_t> rings_;  ///< per vertex
  double unsegmented_ = 0;            ///< Σ l τ ε: the energy of a single segment but for its size
  double small_area_ = 0;
};

struct Segmentation {
  std::vector<Index> segments;  ///< per face; numbered from 0 in the order of their first faces
  Index count = 0;
  std::vector<double> energies;  ///< at the start, after merging, and after each sweep
};

/// Segments the faces twice and returns what has less energy: from a watershed of the distance from ridges, which is
/// best where ridges are complete, and from single faces, which is best where they are full of gaps and noise. Pairs of
/// neighbours are merged as long as that lowers the energy; then follow sweeps of local α-expansions and merges. Each
/// segment is connected across interior edges.
///
/// An expansion sees only the faces within a few steps of the segment's border, so that a sweep takes time in
/// proportion to the borders and not to faces times segments. Its cut minimises an upper bound of the energy that
/// agrees at the present segments, since the true energy has pairs that no cut can represent. The energy never rises.
Segmentation segment_faces(const SegmentField& field);
Segmentation segment_faces(const Mesh& mesh, const Topology& topology, const std::vector<Vec3>& positions,
                           const std::vector<double>& labels, const SegmentOptions& options = {});

}  // namespace crease
