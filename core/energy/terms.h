#pragma once

#include <array>
#include <span>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>

#include "core/energy/continuity.h"
#include "core/energy/curvature.h"
#include "core/energy/likelihood.h"
#include "core/energy/ridge_line.h"
#include "core/energy/sharpness.h"
#include "core/energy/smoothness.h"
#include "core/energy/support.h"

namespace crease {

/// The terms of E(v, ε), in the order of reports. This is the place to add a term; term.h describes its members.
/// Samplers, descent, reports and checkpoints follow this table.
using TermTable = std::tuple<LikelihoodTerm, SmoothnessTerm, SharpnessTerm, SupportTerm, CurvatureTerm, ContinuityTerm,
                             RidgeLineTerm>;

inline constexpr std::size_t kTermCount = std::tuple_size_v<TermTable>;

/// Field number of the total in crease.v1.Energy. The field numbers of the terms must differ from it.
inline constexpr int kTotalField = 5;

/// How reports and messages identify a term.
struct TermName {
  std::string_view name;  ///< in reports
  int field;              ///< field number in crease.v1.Energy
};
inline constexpr std::array<TermName, kTermCount> kTermNames =
    []<typename... Terms>(std::type_identity<std::tuple<Terms...>>) {
      return std::array<TermName, kTermCount>{TermName{Terms::kName, Terms::kField}...};
    }(std::type_identity<TermTable>{});

/// A number for each term, in the order of the table.
class PerTerm {
 public:
  /// The index of a term in the table.
  template <typename Term>
  static constexpr std::size_t place() {
    return []<typename... Terms>(std::type_identity<std::tuple<Terms...>>) {
      std::size_t place = 0;
      static_cast<void>(((std::is_same_v<Terms, Term> || (++place, false)) || ...));
      return place;
    }(std::type_identity<TermTable>{});
  }

  template <typename Term>
  double& of() {
    return values_[place<Term>()];
  }
  template <typename Term>
  double of() const {
    return values_[place<Term>()];
  }
  double& operator[](std::size_t term) { return values_[term]; }
  double operator[](std::size_t term) const { return values_[term]; }

  bool operator==(const PerTerm&) const = default;
  double total() const {
    double total = 0;
    for (const double value : values_) total += value;
    return total;
  }

 private:
  std::array<double, kTermCount> values_{};
};

/// The weight of each term at one moment of the annealing.
using Weights = PerTerm;
/// Each term times its weight.
using Energy = PerTerm;

template <typename Term>
bool is_used(const MrfOptions& options) {
  if constexpr (requires { Term::is_used(options); }) return Term::is_used(options);
  return Term::weight(options) != 0;
}

/// E(v, ε) of one field. Terms that the options do not use are skipped and cost nothing.
class EnergyTerms {
 public:
  explicit EnergyTerms(const TermSetup& setup) : EnergyTerms(setup, std::make_index_sequence<kTermCount>{}) {}

  /// The weights at the end of the annealing.
  const Weights& final_weights() const { return final_weights_; }
  static Neighborhood neighborhood(const MrfOptions& options);

  /// Updates what terms cache of positions and normals. Call Field::update_edges() first.
  void positions_changed(const Field& field, ThreadTeam& team) {
    for_each([&](auto& term) {
      if constexpr (requires { term.positions_changed(field, team); }) term.positions_changed(field, team);
    });
  }
  /// Updates what terms cache of the labels.
  void labels_changed(const Field& field, ThreadTeam& team) {
    for_each([&](auto& term) {
      if constexpr (requires { term.labels_changed(field, team); }) term.labels_changed(field, team);
    });
  }
  /// Updates what slope() uses, after the label of `edge` has changed by `by`.
  void label_set(const Field& field, Index edge, double by) {
    for_each([&](auto& term) {
      if constexpr (requires { term.label_set(field, edge, by); }) term.label_set(field, edge, by);
    });
  }

  /// E, term by term (§3.4). Call positions_changed() first. The result does not depend on the number of threads.
  Energy energy(const Field& field, const Weights& weights, ThreadTeam& team) const {
    Energy result;
    for_each(
        [&]<typename Term>(const Term& term) { result.of<Term>() = weights.of<Term>() * term.energy(field, team); });
    return result;
  }
  /// ∂E/∂ε of an interior edge. Call positions_changed() and label_set() first.
  double slope(const Field& field, const Weights& weights, Index edge) const {
    double slope = 0;
    for_each([&]<typename Term>(const Term& term) {
      if constexpr (requires { term.slope(field, edge); }) slope += weights.of<Term>() * term.slope(field, edge);
    });
    return slope;
  }
  /// E after the move minus E before, with fixed labels. Call labels_changed() first. The terms of the edge process,
  /// sharpness, support and continuity, are left out: the vertex process treats them as constant (§3.5).
  CREASE_LANES_INLINE double change(const Field& field, const Weights& weights, const VertexMove& move) const {
    double change = 0;
    for_each([&]<typename Term>(const Term& term) [[gnu::always_inline]] {
      if constexpr (requires { term.change(field, move); }) change += weights.of<Term>() * term.change(field, move);
    });
    return change;
  }

  template <typename Term>
  const Term& get() const {
    return std::get<Term>(terms_);
  }
  /// Calls `visit(term)` for the terms that the options use.
  template <typename Visit>
  CREASE_LANES_INLINE void for_each(Visit visit) const {
    std::apply([&](const auto&... terms) [[gnu::always_inline]] { (visit_active(terms, visit), ...); }, terms_);
  }

 private:
  template <std::size_t... kTerms>
  EnergyTerms(const TermSetup& setup, std::index_sequence<kTerms...>)
      : terms_(std::tuple_element_t<kTerms, TermTable>(setup)...) {
    ((final_weights_[kTerms] = std::tuple_element_t<kTerms, TermTable>::weight(setup.options)), ...);
    ((is_used_[kTerms] = crease::is_used<std::tuple_element_t<kTerms, TermTable>>(setup.options)), ...);
  }
  template <typename Term, typename Visit>
  CREASE_LANES_INLINE void visit_active(Term& term, Visit& visit) const {
    if (is_used_[PerTerm::place<std::remove_const_t<Term>>()]) visit(term);
  }
  template <typename Visit>
  void for_each(Visit visit) {
    std::apply([&](auto&... terms) { (visit_active(terms, visit), ...); }, terms_);
  }

  TermTable terms_;
  Weights final_weights_;
  std::array<bool, kTermCount> is_used_{};
};

}  // namespace crease
