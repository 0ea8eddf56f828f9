#include "core/graduated/cholesky.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/graduated/elimination.h"

namespace crease {
namespace {

constexpr std::uint32_t kLanes = 8, kColumns = 4;
constexpr std::size_t kSubtrees = 16;  ///< none has more than this part of the work

std::uint32_t padded(std::uint32_t rows) { return (rows + kLanes - 1) / kLanes * kLanes; }

CREASE_LANES_INLINE Lanes load8(const float* numbers) {
  Lanes result;
  std::memcpy(&result, numbers, sizeof result);
  return result;
}

/// C −= A Bᵀ for `kWidth` columns of C and `kHeight` times eight rows; A and B have `depth` columns.
template <std::uint32_t kHeight, std::uint32_t kWidth>
CREASE_LANES_INLINE void subtract_tile(float* c, std::size_t c_stride, const float* a, const float* b,
                                       std::size_t stride, std::uint32_t depth) {
  Lanes sums[kWidth][kHeight];
  for (std::uint32_t j = 0; j < kWidth; ++j) {
    for (std::uint32_t i = 0; i < kHeight; ++i) sums[j][i] = load8(c + j * c_stride + i * kLanes);
  }
  for (std::uint32_t p = 0; p < depth; ++p) {
    Lanes rows[kHeight];
    for (std::uint32_t i = 0; i < kHeight; ++i) rows[i] = load8(a + p * stride + i * kLanes);
    for (std::uint32_t j = 0; j < kWidth; ++j) {
      const float factor = b[p * stride + j];
      for (std::uint32_t i = 0; i < kHeight; ++i) sums[j][i] -= factor * rows[i];
    }
  }
  for (std::uint32_t j = 0; j < kWidth; ++j) {
    for (std::uint32_t i = 0; i < kHeight; ++i) {
      std::memcpy(c + j * c_stride + i * kLanes, &sums[j][i], sizeof(Lanes));
    }
  }
}

template <std::uint32_t kWidth>
CREASE_LANES_INLINE void subtract_columns(float* c, std::size_t c_stride, const float* a, const float* b,
                                          std::size_t stride, std::uint32_t rows, std::uint32_t depth) {
  std::uint32_t i = 0;
  for (; i + kLanes < rows; i += 2 * kLanes) subtract_tile<2, kWidth>(c + i, c_stride, a + i, b, stride, depth);
  if (i < rows) subtract_tile<1, kWidth>(c + i, c_stride, a + i, b, stride, depth);
}

/// C −= A Bᵀ for up to four columns of C. Rows come in eights.
CREASE_WIDE_CLONES void subtract_product(float* c, std::size_t c_stride, const float* a, const float* b,
                                         std::size_t stride, std::uint32_t rows, std::uint32_t columns,
                                         std::uint32_t depth) {
  switch (columns) {
    case 1:
      return subtract_columns<1>(c, c_stride, a, b, stride, rows, depth);
    case 2:
      return subtract_columns<2>(c, c_stride, a, b, stride, rows, depth);
    case 3:
      return subtract_columns<3>(c, c_stride, a, b, stride, rows, depth);
    default:
      return subtract_columns<4>(c, c_stride, a, b, stride, rows, depth);
  }
}

/// column −= factor · other
CREASE_WIDE_CLONES void subtract_column(float* __restrict column, const float* __restrict other, float factor,
                                        std::uint32_t count) {
  for (std::uint32_t i = 0; i < count; ++i) column[i] -= factor * other[i];
}

CREASE_WIDE_CLONES void scale_column(float* column, float scale, std::uint32_t count) {
  for (std::uint32_t i = 0; i < count; ++i) column[i] *= scale;
}

/// What a block leaves to its parent: a lower triangle of `rows` rows, four columns at a time, without the eights of
/// rows above the diagonal.
class Update {
 public:
  explicit Update(std::uint32_t rows) : rows_(padded(rows)) {}

  static std::uint32_t top(std::uint32_t column) { return column / kLanes * kLanes; }
  std::uint32_t stride(std::uint32_t column) const { return rows_ - top(column); }
  /// Where its row `top(column)` is.
  std::size_t begin(std::uint32_t column) const {
    const std::size_t four = column / kColumns;
    const std::size_t left_out = four > 0 ? kLanes * ((four - 1) * (four - 1) / 4) : 0;  // of one column in each four
    return kColumns * (four * rows_ - left_out) + column % kColumns * static_cast<std::size_t>(stride(column));
  }
  std::size_t size() const { return begin(rows_); }

 private:
  std::uint32_t rows_;
};

/// Factorises the columns of a panel; `pivots` are those of the matrix itself.
void factorize_panel(float* panel, std::uint32_t stride, std::uint32_t width, const float* pivots) {
  constexpr float kLeastPivot = 1e-6F;
  for (std::uint32_t first = 0; first < width; first += kColumns) {
    const std::uint32_t columns = std::min(kColumns, width - first), top = first / kLanes * kLanes;
    float* const block = panel + static_cast<std::size_t>(first) * stride;
    if (first > 0)
      subtract_product(block + top, stride, panel + top, panel + first, stride, stride - top, columns, first);
    for (std::uint32_t j = 0; j < columns; ++j) {
      float* const column = block + static_cast<std::size_t>(j) * stride;
      for (std::uint32_t p = 0; p < j; ++p) {
        const float* const other = block + static_cast<std::size_t>(p) * stride;
        subtract_column(column + top, other + top, other[first + j], stride - top);
      }
      float pivot = column[first + j];
      if (!(pivot > kLeastPivot * pivots[first + j])) pivot = pivots[first + j];
      column[first + j] = pivot;
      scale_column(column + top, 1 / std::sqrt(pivot), stride - top);
    }
  }
}

CREASE_WIDE_CLONES void forward_block(const float* panel, std::uint32_t stride, std::uint32_t width,
                                      std::uint32_t row_count, const std::size_t* places, HalfLanes* own,
                                      HalfLanes* all) {
  for (std::uint32_t j = 0; j < width; ++j) {
    HalfLanes sum = own[j];
    for (std::uint32_t p = 0; p < j; ++p) sum -= panel[p * static_cast<std::size_t>(stride) + j] * own[p];
    own[j] = sum / panel[j * static_cast<std::size_t>(stride) + j];
  }
  for (std::uint32_t i = 0; i < row_count; ++i) {
    HalfLanes sum = all[places[i]];
    const float* row = panel + width + i;
    for (std::uint32_t j = 0; j < width; ++j, row += stride) sum -= *row * own[j];
    all[places[i]] = sum;
  }
}

CREASE_WIDE_CLONES void backward_block(const float* panel, std::uint32_t stride, std::uint32_t width,
                                       std::uint32_t row_count, const std::size_t* places, HalfLanes* own,
                                       const HalfLanes* all) {
  for (std::uint32_t j = width; j-- > 0;) {
    const float* const column = panel + j * static_cast<std::size_t>(stride);
    HalfLanes sum = own[j];
    for (std::uint32_t i = 0; i < row_count; ++i) sum -= column[width + i] * all[places[i]];
    for (std::uint32_t p = j + 1; p < width; ++p) sum -= column[p] * own[p];
    own[j] = sum / column[j];
  }
}

}  // namespace

double SparseCholesky::Block::work() const {
  const double k = width(), m = row_count;
  return k * (k + m) * (k + m);
}

SparseCholesky::SparseCholesky(const LowerTriangle& lower) : new_index_(elimination_order(lower)) {
  lay_out(lower);
  find_children();
  find_subtrees();
  find_places();
}

void SparseCholesky::lay_out(const LowerTriangle& lower) {
  std::vector<std::uint32_t> block_of(new_index_.size());
  std::size_t panel = 0;
  for (const EliminationBlock& columns : elimination_blocks(lower, new_index_)) {
    Block block;
    block.begin = columns.begin;
    block.end = columns.end;
    block.rows = rows_.size();
    block.row_count = static_cast<std::uint32_t>(columns.rows.size());
    block.panel = panel;
    block.stride = padded(block.width() + block.row_count);
    panel += static_cast<std::size_t>(block.stride) * block.width();
    for (std::uint32_t j = block.begin; j < block.end; ++j) block_of[j] = static_cast<std::uint32_t>(blocks_.size());
    rows_.insert(rows_.end(), columns.rows.begin(), columns.rows.end());
    blocks_.push_back(block);
  }
  for (Block& block : blocks_) {
    if (block.row_count > 0) block.parent = static_cast<std::int32_t>(block_of[rows_[block.rows]]);
  }
  factor_.resize(panel + kLanes);
  pivots_.resize(new_index_.size());
  for (int column = 0; column < lower.outerSize(); ++column) {
    for (LowerTriangle::InnerIterator it(lower, column); it; ++it) {
      const std::uint32_t i = new_index_[static_cast<std::size_t>(it.row())];
      const std::uint32_t j = new_index_[static_cast<std::size_t>(column)];
      const Block& block = blocks_[block_of[std::min(i, j)]];
      const std::uint32_t row = std::max(i, j);
      const auto begin = rows_.begin() + static_cast<std::ptrdiff_t>(block.rows);
      const std::size_t place =
          row < block.end
              ? row - block.begin
              : block.width() + static_cast<std::size_t>(std::lower_bound(begin, begin + block.row_count, row) - begin);
      if (i == j) diagonal_.push_back(targets_.size());
      targets_.push_back(block.panel + static_cast<std::size_t>(std::min(i, j) - block.begin) * block.stride + place);
    }
  }
}

void SparseCholesky::find_children() {
  children_.resize(blocks_.size());
  in_parent_.resize(rows_.size());
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const Block& block = blocks_[b];
    if (block.parent < 0) continue;
    const Block& parent = blocks_[static_cast<std::size_t>(block.parent)];
    children_[static_cast<std::size_t>(block.parent)].push_back(static_cast<std::uint32_t>(b));
    std::uint32_t place = 0;
    for (std::size_t r = block.rows; r < block.rows + block.row_count; ++r) {
      if (rows_[r] < parent.end) {
        in_parent_[r] = rows_[r] - parent.begin;
        continue;
      }
      while (rows_[parent.rows + place] < rows_[r]) ++place;
      in_parent_[r] = parent.width() + place;
    }
  }
}

void SparseCholesky::find_subtrees() {
  std::vector<double> work(blocks_.size());
  std::vector<std::uint32_t> first(blocks_.size());
  double total = 0;
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    first[b] = children_[b].empty() ? static_cast<std::uint32_t>(b) : first[children_[b].front()];
    work[b] = blocks_[b].work();
    total += work[b];
    for (const std::uint32_t child : children_[b]) work[b] += work[child];
  }
  const double most = total / kSubtrees;
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const std::int32_t parent = blocks_[b].parent;
    if (work[b] > most) {
      top_.push_back(static_cast<std::uint32_t>(b));
    } else if (parent < 0 || work[static_cast<std::size_t>(parent)] > most) {
      subtrees_.push_back({first[b], static_cast<std::uint32_t>(b), 0});
    }
  }
}

/// What a subtree takes from rows above it, it sums up in a place of its own.
void SparseCholesky::find_places() {
  places_.assign(rows_.begin(), rows_.end());
  side_count_ = new_index_.size();
  for (Subtree& subtree : subtrees_) {
    const Block& root = blocks_[subtree.last];
    const auto begin = rows_.begin() + static_cast<std::ptrdiff_t>(root.rows), end = begin + root.row_count;
    subtree.sums = side_count_;
    for (std::size_t r = blocks_[subtree.first].rows; r < root.rows + root.row_count; ++r) {
      if (rows_[r] < root.end) continue;
      places_[r] = subtree.sums + static_cast<std::size_t>(std::lower_bound(begin, end, rows_[r]) - begin);
    }
    side_count_ += root.row_count;
  }
}

void SparseCholesky::factorize(const LowerTriangle& lower, ThreadTeam& team) {
  const double* const values = lower.valuePtr();
  std::ranges::fill(factor_, 0.0F);
  for (std::size_t k = 0; k < targets_.size(); ++k) factor_[targets_[k]] = static_cast<float>(values[k]);
  for (std::size_t column = 0; column < diagonal_.size(); ++column) {
    pivots_[new_index_[column]] = static_cast<float>(values[diagonal_[column]]);
  }
  Updates updates(blocks_.size());
  const auto eliminated = [&](std::size_t b) {
    assemble(b, updates);
    eliminate(b, updates);
  };
  team.run(subtrees_.size(), 1, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t s = begin; s < end; ++s) {
      for (std::size_t b = subtrees_[s].first; b <= subtrees_[s].last; ++b) eliminated(b);
    }
  });
  for (const std::uint32_t b : top_) eliminated(b);
}

/// Adds what the children leave to the block's panel and to what the block leaves.
void SparseCholesky::assemble(std::size_t b, Updates& updates) {
  const Block& block = blocks_[b];
  const std::uint32_t width = block.width();
  const Update update(block.row_count);
  updates[b].assign(update.size(), 0.0F);
  for (const std::uint32_t c : children_[b]) {
    const Block& child = blocks_[c];
    const Update left(child.row_count);
    const std::uint32_t* const place = in_parent_.data() + child.rows;
    for (std::uint32_t j = 0; j < child.row_count; ++j) {
      const float* const from = updates[c].data() + left.begin(j);
      const std::uint32_t column = place[j], below = column - width;
      float* const to = column < width ? factor_.data() + block.panel + static_cast<std::size_t>(column) * block.stride
                                       : updates[b].data() + update.begin(below);
      const std::uint32_t first = column < width ? 0 : width + Update::top(below);
      for (std::uint32_t i = j; i < child.row_count; ++i) to[place[i] - first] += from[i - Update::top(j)];
    }
    updates[c] = {};
  }
}

void SparseCholesky::eliminate(std::size_t b, Updates& updates) {
  const Block& block = blocks_[b];
  const std::uint32_t width = block.width(), rows = block.row_count;
  float* const panel = factor_.data() + block.panel;
  factorize_panel(panel, block.stride, width, pivots_.data() + block.begin);
  const float* const below = panel + width;
  const Update update(rows);
  for (std::uint32_t first = 0; first < rows; first += kColumns) {
    const std::uint32_t top = Update::top(first), height = update.stride(first);
    subtract_product(updates[b].data() + update.begin(first), height, below + top, below + first, block.stride, height,
                     std::min(kColumns, rows - first), width);
  }
}

void SparseCholesky::go_up(std::size_t b, std::span<HalfLanes> sides) const {
  const Block& block = blocks_[b];
  forward_block(factor_.data() + block.panel, block.stride, block.width(), block.row_count, places_.data() + block.rows,
                sides.data() + block.begin, sides.data());
}

void SparseCholesky::go_down(std::size_t b, std::span<HalfLanes> sides) const {
  const Block& block = blocks_[b];
  backward_block(factor_.data() + block.panel, block.stride, block.width(), block.row_count,
                 places_.data() + block.rows, sides.data() + block.begin, sides.data());
}

void SparseCholesky::solve(std::span<HalfLanes> sides, ThreadTeam& team) const {
  std::vector<HalfLanes> all(side_count_, HalfLanes{});
  for (std::size_t i = 0; i < sides.size(); ++i) all[new_index_[i]] = sides[i];
  team.run(subtrees_.size(), 1, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t s = begin; s < end; ++s) {
      for (std::size_t b = subtrees_[s].first; b <= subtrees_[s].last; ++b) go_up(b, all);
    }
  });
  const auto each_sum = [&](auto body) {
    for (const Subtree& subtree : subtrees_) {
      const Block& root = blocks_[subtree.last];
      for (std::uint32_t i = 0; i < root.row_count; ++i) body(all[subtree.sums + i], all[rows_[root.rows + i]]);
    }
  };
  each_sum([](const HalfLanes& sum, HalfLanes& side) { side += sum; });
  for (const std::uint32_t b : top_) go_up(b, all);
  for (std::size_t k = top_.size(); k-- > 0;) go_down(top_[k], all);
  each_sum([](HalfLanes& sum, const HalfLanes& side) { sum = side; });
  team.run(subtrees_.size(), 1, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t s = begin; s < end; ++s) {
      for (std::size_t b = subtrees_[s].last + 1; b-- > subtrees_[s].first;) go_down(b, all);
    }
  });
  for (std::size_t i = 0; i < sides.size(); ++i) sides[i] = all[new_index_[i]];
}

}  // namespace crease
