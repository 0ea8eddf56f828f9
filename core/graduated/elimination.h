#pragma once

#include <Eigen/SparseCore>
#include <cstdint>
#include <vector>

namespace crease {

/// The lower triangle of a symmetric matrix, with its diagonal, compressed.
using LowerTriangle = Eigen::SparseMatrix<double>;

/// The new index of each row and column, in an order that keeps the Cholesky factor sparse: minimum degree, then along
/// the elimination tree, children before parents and subtrees without gaps [Liu 1990].
std::vector<std::uint32_t> elimination_order(const LowerTriangle& lower);

/// Columns [begin, end) of the factor, whose rows are the same or nearly so.
struct EliminationBlock {
  std::uint32_t begin = 0, end = 0;
  std::vector<std::uint32_t> rows;  ///< below them, rising
  double filled = 0;                ///< entries that are not zero
};

/// The blocks of the Cholesky factor, by rising columns. Neighbouring columns whose rows nearly agree are one block,
/// which then has a few zeros.
std::vector<EliminationBlock> elimination_blocks(const LowerTriangle& lower,
                                                 const std::vector<std::uint32_t>& new_index);

}  // namespace crease
