#include "core/graduated/face_tiles.h"

#include <algorithm>

namespace crease {
namespace {

using PerFace = std::array<std::vector<std::int32_t>, 3>;

/// Numbers items in the order in which it is asked for them.
class Numbering {
 public:
  explicit Numbering(std::size_t items) : numbered_in_(items, kNone), number_(items) {}

  void begin(Index round) {
    round_ = round;
    count_ = 0;
  }
  /// Calls `on_new` for an item without a number.
  template <typename OnNew>
  Index of(std::size_t item, OnNew on_new) {
    if (numbered_in_[item] == round_) return number_[item];
    numbered_in_[item] = round_;
    on_new();
    return number_[item] = count_++;
  }
  Index count() const { return count_; }

 private:
  std::vector<Index> numbered_in_, number_;
  Index round_ = kNone, count_ = 0;
};

class Tiling {
 public:
  Tiling(std::size_t vertex_count, std::size_t face_count, const PerFace& corners, const PerFace& neighbors,
         FaceTiles& result)
      : face_count_(face_count),
        corners_(corners),
        neighbors_(neighbors),
        result_(result),
        vertices_(vertex_count),
        rim_(face_count) {
    const std::size_t blocks = (face_count + kLaneCount - 1) / kLaneCount;
    result_.neighbors.resize(blocks);
    result_.corners.reserve(blocks + blocks / 4);
    for (std::size_t begin = 0; begin < face_count; begin += FaceTiles::kFaces) add_tile(begin);
    tie_vertices(vertex_count);
  }

 private:
  using Tile = FaceTiles::Tile;

  void add_tile(std::size_t begin) {
    const std::size_t end = std::min(face_count_, begin + FaceTiles::kFaces);
    Tile tile{.first_vertex = result_.vertex.size(), .first_sum = sums_, .first_block = result_.corners.size()};
    const auto round = static_cast<Index>(result_.tiles.size());
    vertices_.begin(round);
    rim_.begin(round);
    const std::size_t own_blocks = (end - begin + kLaneCount - 1) / kLaneCount;
    result_.corners.resize(tile.first_block + own_blocks);
    for (std::size_t f = begin; f < end; ++f) put_corners(tile, f, f - begin);
    tile.sums = vertices_.count();
    sums_ += tile.sums;
    for (std::size_t f = begin; f < end; ++f) {
      for (std::size_t k = 0; k < 3; ++k) {
        const auto other = static_cast<std::size_t>(neighbors_[k][f]);
        const bool own = begin <= other && other < end;
        result_.neighbors[f / kLaneCount][k][f % kLaneCount] =
            static_cast<FaceTiles::Place>(own ? other - begin : rim_face(tile, own_blocks, other));
      }
    }
    tile.vertices = vertices_.count();
    tile.blocks = result_.corners.size() - tile.first_block;
    result_.most_vertices = std::max(result_.most_vertices, tile.vertices);
    result_.most_blocks = std::max(result_.most_blocks, tile.blocks);
    result_.tiles.push_back(tile);
  }

  /// The corners of face `f` of the mesh as face `place` of the tile.
  void put_corners(const Tile& tile, std::size_t f, std::size_t place) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto v = static_cast<std::size_t>(corners_[k][f]);
      const Index number = vertices_.of(v, [&] { result_.vertex.push_back(static_cast<Index>(v)); });
      result_.corners[tile.first_block + place / kLaneCount][k][place % kLaneCount] =
          static_cast<FaceTiles::Place>(number);
    }
  }

  std::size_t rim_face(const Tile& tile, std::size_t own_blocks, std::size_t f) {
    bool is_new = false;
    const std::size_t place = own_blocks * kLaneCount + rim_.of(f, [&] { is_new = true; });
    if (!is_new) return place;
    if (place / kLaneCount == result_.corners.size() - tile.first_block) result_.corners.emplace_back();
    put_corners(tile, f, place);
    return place;
  }

  void tie_vertices(std::size_t vertex_count) {
    IndexRows& rows = result_.vertex_sums;
    rows.starts.assign(vertex_count + 1, 0);
    const auto visit_sums = [&](auto visit) {
      for (const Tile& tile : result_.tiles) {
        for (std::size_t i = 0; i < tile.sums; ++i) visit(result_.vertex[tile.first_vertex + i], tile.first_sum + i);
      }
    };
    visit_sums([&](Index v, std::size_t) { ++rows.starts[v + 1]; });
    for (std::size_t v = 0; v < vertex_count; ++v) rows.starts[v + 1] += rows.starts[v];
    rows.items.resize(rows.starts.back());
    std::vector<Index> next(rows.starts.begin(), rows.starts.end() - 1);
    visit_sums([&](Index v, std::size_t sum) { rows.items[next[v]++] = static_cast<Index>(sum); });
  }

  std::size_t face_count_;
  const PerFace &corners_, &neighbors_;
  FaceTiles& result_;
  Numbering vertices_, rim_;
  std::size_t sums_ = 0;
};

}  // namespace

FaceTiles::FaceTiles(std::size_t vertex_count, std::size_t face_count, const PerFace& mesh_corners,
                     const PerFace& mesh_neighbors) {
  Tiling(vertex_count, face_count, mesh_corners, mesh_neighbors, *this);
}

}  // namespace crease
