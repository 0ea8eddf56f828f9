#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/thread_team.h"
#include "core/geometry/lanes.h"
#include "core/graduated/elimination.h"

namespace crease {

/// Factorises sparse positive definite matrices of one pattern, L Lᵀ, and solves with them. Columns of like structure
/// are a block, whose dense front is eliminated at once [Duff & Reid 1983]; blocks are small enough for one core, and
/// subtrees of their elimination tree are factorised in parallel. It is over ten times as fast as the factorisation of
/// Eigen, column by column; the fast one of SuiteSparse is not free for every use. In single precision: the factors
/// serve as a metric, and whoever needs more refines. The result does not depend on the threads.
class SparseCholesky {
 public:
  /// Only the pattern counts.
  explicit SparseCholesky(const LowerTriangle& lower);

  /// `lower` has the pattern. A pivot that rounding has eaten becomes that of the matrix.
  void factorize(const LowerTriangle& lower, ThreadTeam& team);

  /// Up to four right sides at once, one in each lane, in place.
  void solve(std::span<HalfLanes> sides, ThreadTeam& team) const;

 private:
  /// Columns [begin, end) of the reordered matrix, and the rows below them that are not empty.
  struct Block {
    std::uint32_t begin = 0, end = 0;
    std::size_t rows = 0;  ///< where its rows begin in `rows_`
    std::uint32_t row_count = 0;
    std::size_t panel = 0;  ///< where its columns begin in `factor_`
    std::uint32_t stride = 0;
    std::int32_t parent = -1;
    std::uint32_t width() const { return end - begin; }
    double work() const;
  };
  /// A subtree: blocks [first, last], the last one its root.
  struct Subtree {
    std::uint32_t first = 0, last = 0;
    std::size_t sums = 0;  ///< where its share of the rows above begins in a vector of `solve`
  };
  using Updates = std::vector<std::vector<float>>;

  void lay_out(const LowerTriangle& lower);
  void find_children();
  void find_subtrees();
  void find_places();
  void assemble(std::size_t block, Updates& updates);
  void eliminate(std::size_t block, Updates& updates);
  void go_down(std::size_t block, std::span<HalfLanes> sides) const;
  void go_up(std::size_t block, std::span<HalfLanes> sides) const;

  std::vector<std::uint32_t> new_index_;  ///< of each row of the matrix
  std::vector<Block> blocks_;             ///< children before parents, subtrees without gaps
  std::vector<std::uint32_t> rows_;       ///< of all blocks, rising in each
  std::vector<std::uint32_t> in_parent_;  ///< for each of them: its row in the parent's front
  std::vector<std::size_t> places_;       ///< for each of them: in a vector of `solve`
  std::vector<std::vector<std::uint32_t>> children_;
  std::vector<std::size_t> targets_;   ///< per entry of the matrix: in `factor_`
  std::vector<std::size_t> diagonal_;  ///< per column of the matrix: the entry on it
  std::vector<Subtree> subtrees_;
  std::vector<std::uint32_t> top_;  ///< blocks above the subtrees
  std::size_t side_count_ = 0;      ///< numbers in a vector of `solve`
  std::vector<float> pivots_;       ///< of the matrix itself, reordered
  std::vector<float> factor_;
};

}  // namespace crease
