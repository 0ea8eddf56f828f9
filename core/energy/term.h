#pragma once

#include <span>

#include "core/energy/field.h"
#include "core/options/options.h"

namespace crease {

/// The arguments of a term's constructor. Only the constructor reads the options and the vertex weights.
///
/// A term is a class with the members of the first group, and those of the other groups that apply to it. There are no
/// virtual functions: the table in terms.h finds out at compile time which functions a term has. All values exclude the
/// term's weight.
///
/// What it is:
///
///     static constexpr std::string_view kName;               // in reports
///     static constexpr int kField;                           // field number in crease.v1.Energy; never changes
///     static double weight(const MrfOptions&);               // at the end of the annealing
///     static bool is_used(const MrfOptions&);                // optional; otherwise, whether the weight is not 0
///     static Neighborhood neighborhood(const MrfOptions&);   // optional; otherwise kFirstOrder
///     explicit Term(const TermSetup&);
///     double energy(const Field&, ThreadTeam&) const;        // of the whole field
///
/// What updates the values that it caches:
///
///     void positions_changed(const Field&, ThreadTeam&);     // after positions and normals have changed
///     void labels_changed(const Field&, ThreadTeam&);        // after any labels have changed
///     void label_set(const Field&, Index edge, double by);   // after the label of one edge has changed by `by`
///
/// What the samplers ask for:
///
///     double slope(const Field&, Index edge) const;          // ∂energy/∂ε of the edge
///     double change(const Field&, const VertexMove&) const;  // energy after the move minus energy before
///
/// What descent asks for (see gradient.h). A term is a sum over edges, faces or vertices:
///
///     Potential<Real> at(Index edge, Real chord) const;      // summand of an edge and its derivative by
///                                                            // chord = ‖n_i − n_j‖²
///     Real at_normals(const Normals&, Index face) const;     // summand of a face
///     Vector by_normal(const Normals&, Index face) const;    // ∂(sum over all faces)/∂n of the face
///     Real at_positions(const Points&, Index vertex) const;  // summand of a vertex
///     Vector by_position(const Points&, Index vertex) const; // ∂(sum over all vertices)/∂v of the vertex
struct TermSetup {
  const Field& field;  ///< a constructor may not depend on its positions and labels
  const MrfOptions& options;
  std::span<const double> vertex_weights;  ///< w_v of the likelihood; empty if all are 1
};

/// Which pairs of vertices a term couples.
enum class Neighborhood {
  kFirstOrder,  ///< vertices of the same face, or of two faces that share an edge (§3.2, Fig. 1)
  kWide,        ///< also vertices whose faces have neighbours with a common vertex; covers every term
};

}  // namespace crease
