#pragma once

#include <span>

#include "core/energy/field.h"
#include "core/options/options.h"

namespace crease {

/// What a term is made from. Options and weights are read by constructors only.
///
/// A term is a class with a name, a weight, and those of the functions below that it has something to say to. Nothing
/// is virtual: the table in terms.h finds out at compile time which functions a term has. None of them multiplies by
/// the term's weight.
///
///     static constexpr std::string_view kName;              // in reports
///     static constexpr int kField;                          // number in crease.v1.Energy, for ever
///     static double weight(const MrfOptions&);              // of the term in E, at the end of the annealing
///     static bool is_used(const MrfOptions&);               // where that is not the same as a weight other than 0
///     static Neighborhood neighborhood(const MrfOptions&);  // how far it reaches; kFirstOrder where it has none
///     explicit Term(const TermSetup&);
///
///     double energy(const Field&, ThreadTeam&) const;       // the term of the field as it is
///     void positions_changed(const Field&, ThreadTeam&);    // what it keeps of positions and normals
///     void labels_changed(const Field&, ThreadTeam&);       // what it keeps of the labels
///     void label_set(const Field&, Index edge, double by);  // the same after a change of one label
///
///     double slope(const Field&, Index edge) const;         // sampling labels: ∂/∂ε of an edge
///     double change(const Field&, const VertexMove&) const; // sampling positions: after the move minus now
///
/// For descent, see gradient.h:
///
///     Potential<Real> at(Index edge, Real chord) const;     // of an edge, by ‖n_i − n_j‖², with its derivative
///     Real at_normals(const Normals&, Index face) const;    // of a face
///     Vector by_normal(const Normals&, Index face) const;   // ∂(sum over all faces)/∂n of a face
///     Real at_positions(const Points&, Index vertex) const; // of a vertex
///     Vector by_position(const Points&, Index vertex) const;// ∂(sum over all vertices)/∂v of a vertex
struct TermSetup {
  const Field& field;  ///< with measured positions and faces; positions and labels may be anything
  const MrfOptions& options;
  std::span<const double> vertex_weights;  ///< w_v of the likelihood, empty for 1 everywhere
};

/// How far apart vertices can see each other in a term.
enum class Neighborhood {
  kFirstOrder,  ///< in faces that share an edge or are the same (§3.2, Fig. 1)
  kWide,        ///< in faces next to faces that share a vertex with each other's: more than any term sees
};

}  // namespace crease
