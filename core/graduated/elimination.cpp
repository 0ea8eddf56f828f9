#include "core/graduated/elimination.h"

#include <Eigen/OrderingMethods>
#include <algorithm>
#include <utility>

namespace crease {
namespace {

/// The elimination tree of a symmetric matrix [Liu 1990]. `upper[j]`: rows above the diagonal of column j.
std::vector<std::int32_t> elimination_tree(const std::vector<std::vector<std::uint32_t>>& upper) {
  std::vector<std::int32_t> parent(upper.size(), -1), ancestor(upper.size(), -1);
  for (std::size_t j = 0; j < upper.size(); ++j) {
    for (const std::uint32_t row : upper[j]) {
      auto i = static_cast<std::int32_t>(row);
      while (i != -1 && i != static_cast<std::int32_t>(j)) {
        const std::int32_t next = std::exchange(ancestor[static_cast<std::size_t>(i)], static_cast<std::int32_t>(j));
        if (next == -1) parent[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(j);
        i = next;
      }
    }
  }
  return parent;
}

/// Children before parents, subtrees without gaps: the columns in that order.
std::vector<std::uint32_t> postorder(const std::vector<std::int32_t>& parent) {
  const std::size_t count = parent.size();
  std::vector<std::int32_t> first_child(count, -1), next_sibling(count, -1);
  std::vector<std::int32_t> roots;
  for (std::size_t j = count; j-- > 0;) {
    if (parent[j] < 0) {
      roots.push_back(static_cast<std::int32_t>(j));
      continue;
    }
    next_sibling[j] = std::exchange(first_child[static_cast<std::size_t>(parent[j])], static_cast<std::int32_t>(j));
  }
  std::vector<std::uint32_t> order, open;
  order.reserve(count);
  for (const std::int32_t root : roots) {
    open.push_back(static_cast<std::uint32_t>(root));
    while (!open.empty()) {
      const std::uint32_t j = open.back();
      const std::int32_t child = first_child[j];
      if (child < 0) {
        order.push_back(j);
        open.pop_back();
      } else {
        first_child[j] = next_sibling[static_cast<std::size_t>(child)];
        open.push_back(static_cast<std::uint32_t>(child));
      }
    }
  }
  return order;
}

using Pattern = std::vector<std::vector<std::uint32_t>>;  ///< rows, column by column

/// The rows above the diagonal, with rows and columns renamed.
Pattern upper_pattern(const LowerTriangle& lower, const std::vector<std::uint32_t>& new_index) {
  Pattern upper(new_index.size());
  for (int column = 0; column < lower.outerSize(); ++column) {
    for (LowerTriangle::InnerIterator it(lower, column); it; ++it) {
      const std::uint32_t i = new_index[static_cast<std::size_t>(it.row())];
      const std::uint32_t j = new_index[static_cast<std::size_t>(column)];
      if (i != j) upper[std::max(i, j)].push_back(std::min(i, j));
    }
  }
  return upper;
}

double entries(double width, double rows) { return width * (width + 1) / 2 + width * rows; }

/// Whether a block may take in a child: the more columns, the fewer zeros come with it.
bool is_worth_merging(const EliminationBlock& child, const EliminationBlock& parent) {
  const double width = parent.end - child.begin;
  const double all = entries(width, static_cast<double>(parent.rows.size()));
  const double zeros = 1 - (child.filled + parent.filled) / all;
  return width <= 4 || zeros < 0.05 || (zeros < 0.1 && width <= 48) || (zeros < 0.4 && width <= 16);
}

void push_merged(std::vector<EliminationBlock>& blocks, EliminationBlock block) {
  while (!blocks.empty()) {
    EliminationBlock& child = blocks.back();
    if (child.rows.empty() || child.rows.front() >= block.end || !is_worth_merging(child, block)) break;
    block.filled += child.filled;
    block.begin = child.begin;
    blocks.pop_back();
  }
  blocks.push_back(std::move(block));
}

}  // namespace

std::vector<std::uint32_t> elimination_order(const LowerTriangle& lower) {
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;
  LowerTriangle copy = lower;  // the ordering wants a matrix of its own
  Eigen::AMDOrdering<int>()(copy.selfadjointView<Eigen::Lower>(), order);
  std::vector<std::uint32_t> new_index(static_cast<std::size_t>(lower.cols()));
  for (int k = 0; k < order.size(); ++k) {
    new_index[static_cast<std::size_t>(order.indices()[k])] = static_cast<std::uint32_t>(k);
  }
  const std::vector<std::uint32_t> columns = postorder(elimination_tree(upper_pattern(lower, new_index)));
  std::vector<std::uint32_t> place(columns.size());
  for (std::size_t k = 0; k < columns.size(); ++k) place[columns[k]] = static_cast<std::uint32_t>(k);
  for (std::uint32_t& index : new_index) index = place[index];
  return new_index;
}

std::vector<EliminationBlock> elimination_blocks(const LowerTriangle& lower,
                                                 const std::vector<std::uint32_t>& new_index) {
  const Pattern upper = upper_pattern(lower, new_index);
  const std::vector<std::int32_t> parent = elimination_tree(upper);
  const std::size_t count = upper.size();
  Pattern below(count), children(count);
  for (std::uint32_t j = 0; j < count; ++j) {
    for (const std::uint32_t i : upper[j]) below[i].push_back(j);
    if (parent[j] >= 0) children[static_cast<std::size_t>(parent[j])].push_back(j);
  }
  std::vector<EliminationBlock> blocks;
  std::vector<std::uint32_t> seen(count, ~0U);
  EliminationBlock open;
  for (std::uint32_t j = 0; j < count; ++j) {
    std::vector<std::uint32_t> rows = std::move(below[j]);
    for (const std::uint32_t i : rows) seen[i] = j;
    for (const std::uint32_t child : children[j]) {
      for (const std::uint32_t i : below[child]) {
        if (i != j && std::exchange(seen[i], j) != j) rows.push_back(i);
      }
    }
    const bool continues =
        j > 0 && parent[j - 1] == static_cast<std::int32_t>(j) && below[j - 1].size() == rows.size() + 1;
    for (const std::uint32_t child : children[j]) below[child] = {};
    if (j > 0 && !continues) push_merged(blocks, std::exchange(open, {j, j, {}, 0}));
    std::ranges::sort(rows);
    open.end = j + 1;
    open.filled += static_cast<double>(rows.size()) + 1;
    open.rows = rows;
    below[j] = std::move(rows);
  }
  if (count > 0) push_merged(blocks, std::move(open));
  return blocks;
}

}  // namespace crease
