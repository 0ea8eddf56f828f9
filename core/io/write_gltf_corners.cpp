#include "core/io/write_gltf_corners.h"

#include <bit>
#include <map>
#include <numeric>
#include <unordered_map>

#include "core/io/corner_fans.h"
#include "core/io/corner_normals.h"
#include "core/mesh/position_index.h"

namespace crease {
namespace {

/// Joins the corners around one vertex into parts: those of one fan with the same look.
class PartFinder {
 public:
  PartFinder(const LabelledMesh& result, const std::vector<Triangle>& looks)
      : segments_(result.segments), looks_(looks), ridges_(ridge_ends(result)) {}

  /// The part of each corner, named by its first corner.
  const std::vector<std::size_t>& find(Index vertex, const std::vector<Corner>& corners) {
    const std::vector<std::size_t>& fans = finder_.find(vertex, corners, ridges_[vertex], segments_);
    if (looks_.empty()) return fans;
    parts_.resize(corners.size());
    first_.clear();
    for (std::size_t i = 0; i < corners.size(); ++i) {
      parts_[i] = first_.try_emplace({fans[i], looks_[corners[i].face][corners[i].place]}, i).first->second;
    }
    return parts_;
  }

 private:
  const std::vector<Index>& segments_;
  const std::vector<Triangle>& looks_;
  IndexRows ridges_;
  FanFinder finder_;
  std::map<std::pair<std::size_t, Index>, std::size_t> first_;
  std::vector<std::size_t> parts_;
};

/// Numbers what is different, by its bits.
template <std::size_t N>
class ValueNumbers {
 public:
  Index number_of(const std::array<float, N>& value) {
    return numbers_.try_emplace(value, static_cast<Index>(numbers_.size())).first->second;
  }

 private:
  struct Hash {
    std::size_t operator()(const std::array<float, N>& value) const {
      std::uint64_t hash = 0;
      for (const float number : value) hash = salted_hash(hash, std::bit_cast<std::uint32_t>(number), 0);
      return hash;
    }
  };
  std::unordered_map<std::array<float, N>, Index, Hash> numbers_;
};

struct PairHash {
  std::size_t operator()(std::uint64_t pair) const { return salted_hash(pair, 0, 0); }
};

/// Joins the values of a layer to what is known of the looks of corners.
template <std::size_t N>
void join_layer(const CornerValues<N>& layer, std::vector<Triangle>& looks) {
  if (layer.corners.empty()) return;  // the same at all corners of a vertex
  ValueNumbers<N> values;
  std::vector<Index> number_of;
  number_of.reserve(layer.values.size());
  for (const auto& value : layer.values) number_of.push_back(values.number_of(value));
  if (looks.empty()) looks.assign(layer.corners.size(), {0, 0, 0});
  std::unordered_map<std::uint64_t, Index, PairHash> pairs;
  for (std::size_t face = 0; face < looks.size(); ++face) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Index number = layer.corners[face][k] == kNone ? kNone : number_of[layer.corners[face][k]];
      const std::uint64_t pair = std::uint64_t{looks[face][k]} << 32U | number;
      looks[face][k] = pairs.try_emplace(pair, static_cast<Index>(pairs.size())).first->second;
    }
  }
}

}  // namespace

std::vector<Triangle> corner_looks(const Appearance& appearance) {
  std::vector<Triangle> looks;
  join_layer(appearance.colours, looks);
  for (const CornerValues<2>& set : appearance.texture) join_layer(set, looks);
  return looks;
}

SplitMesh split_along_ridges(const LabelledMesh& result, const std::vector<Triangle>& looks) {
  const Mesh& mesh = result.mesh;
  const std::vector<std::array<Vec3, 3>> normals = corner_normals(result);
  const CornerRows rows(mesh);

  SplitMesh split;
  split.triangles = mesh.triangles;
  split.source.resize(mesh.positions.size());
  std::iota(split.source.begin(), split.source.end(), Index{0});
  split.normals.assign(mesh.positions.size(), Vec3::UnitZ());

  std::vector<Corner> corners;
  std::vector<Index> vertex_of_part;
  PartFinder finder(result, looks);
  for (Index vertex = 0; vertex < mesh.positions.size(); ++vertex) {
    rows.read(vertex, corners);
    const std::vector<std::size_t>& parts = finder.find(vertex, corners);
    vertex_of_part.assign(corners.size(), kNone);
    for (std::size_t i = 0; i < corners.size(); ++i) {
      Index& part_vertex = vertex_of_part[parts[i]];
      if (part_vertex == kNone && i == 0) part_vertex = vertex;
      if (part_vertex == kNone) {
        part_vertex = static_cast<Index>(split.source.size());
        split.source.push_back(vertex);
        split.normals.emplace_back(Vec3::UnitZ());
      }
      split.triangles[corners[i].face][corners[i].place] = part_vertex;
      split.normals[part_vertex] = normals[corners[i].face][corners[i].place];
    }
  }
  return split;
}

}  // namespace crease
