#include "core/regression/label_features.h"

#include <algorithm>
#include <cmath>

namespace crease {
namespace {

constexpr float kLeastLength = 0.02F;  ///< of an edge

std::vector<float> turns_of(const FlatMesh& mesh, std::span<const float> unit_normals, ThreadTeam& team) {
  std::vector<LaneRow> normals(mesh.face_count);
  for_each(mesh.face_count, team, [&](std::size_t f) {
    const auto [x, y, z] = vector_at(unit_normals, f);
    normals[f].row = HalfLanes{x, y, z, 0};
  });
  std::vector<float> turns(mesh.edge_count);
  for_each(mesh.edge_count, team, [&](std::size_t e) {
    const auto normal = [&](std::size_t side) {
      return normals[static_cast<std::size_t>(mesh.edge_faces[side][e])].row;
    };
    const HalfLanes turn = normal(0) - normal(1);
    turns[e] = std::sqrt(dot(turn, turn));
  });
  return turns;
}

}  // namespace

LabelFeatures::LabelFeatures(const FlatMesh& mesh, std::span<const float> positions, std::span<const float> reference,
                             std::span<const float> normals, const DescentSight& sight, ThreadTeam& team)
    : mesh_(mesh),
      along_(mesh.edge_count),
      lengths_(mesh.edge_count),
      walks_(mesh, positions, turns_[kOfResult], along_, spokes_, team),
      sight_(sight.features()) {
  turns_[kOfResult] = turns_of(mesh, face_normals(mesh, positions, team), team);
  turns_[kOfUpload] = turns_of(mesh, face_normals(mesh, mesh.measured, team), team);
  turns_[kOfReference] =
      reference.empty() ? turns_[kOfResult] : turns_of(mesh, face_normals(mesh, reference, team), team);
  turns_[kOfWanted] = normals.empty() ? turns_[kOfResult] : turns_of(mesh, normals, team);
  spokes_ = Spokes(mesh, turns_[kOfResult], turns_[kOfWanted]);
  for_each(mesh.edge_count, team, [&](std::size_t e) {
    const auto end = [&](std::size_t side) {
      const auto [x, y, z] = vector_at(positions, static_cast<std::size_t>(mesh.edge_ends[side][e]));
      return HalfLanes{x, y, z, 0};
    };
    const HalfLanes along = end(1) - end(0);
    along_[e].row = normalized(along);
    lengths_[e] = std::log(std::max(kLeastLength, std::sqrt(dot(along, along))));
  });
}

std::array<float, 2> LabelFeatures::turns_beyond(std::size_t edge, std::size_t side) const {
  std::array<float, 2> largest{};
  spokes_.for_each_beyond(edge, side, along_, [&](std::size_t other, float cosine) {
    for (std::size_t k = 0; k < kTelling.size(); ++k) {
      largest[k] = std::max(largest[k], turns_[kTelling[k]][other] * cosine);
    }
  });
  return largest;
}

void LabelFeatures::put_edge(std::size_t edge, std::size_t lane, Block& block) const {
  std::size_t next = 0;
  const auto put = [&](float feature) { block[next++][lane] = feature; };
  for (const std::vector<float>& turns : turns_) put(turns[edge]);
  const std::array<float, 2> one = turns_beyond(edge, 0), two = turns_beyond(edge, 1);
  for (std::size_t k = 0; k < kTelling.size(); ++k) {
    const std::vector<float>& turns = turns_[kTelling[k]];
    std::array<float, 4> around{};
    std::size_t known = 0;
    for (const auto& faces : mesh_.edge_faces) {
      for (const auto& sides : mesh_.sides) {
        const auto other = static_cast<std::size_t>(sides[static_cast<std::size_t>(faces[edge])]);
        if (other != edge && known < around.size()) around[known++] = other < mesh_.edge_count ? turns[other] : 0;
      }
    }
    std::ranges::sort(around);
    for (const float turn : around) put(turn);
    put(std::min(one[k], two[k]));
    put(std::max(one[k], two[k]));
  }
  put(lengths_[edge]);
  for (const float number : sight_) put(number);
  for (const float number : walks_.features(edge)) put(number);
}

LabelFeatures::Block LabelFeatures::block(std::size_t block) const {
  Block features{};
  for (std::size_t lane = 0; lane < kLaneCount; ++lane) {
    const std::size_t edge = block * kLaneCount + lane;
    if (edge < mesh_.edge_count) put_edge(edge, lane, features);
  }
  return features;
}

}  // namespace crease
