#include "core/regression/ridge_walks.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace crease {
namespace {

constexpr float kOwnVertices = 2;            ///< of an edge
constexpr float kLeastTurn = 0.2F;           ///< of an edge that is walked along
constexpr float kLeastContinuation = 0.15F;  ///< of the turn of the next edge, times the cosine between the two
constexpr float kLeastLikeness = 0.8F;  ///< cosine between the normals of a side where a walk begins and further on

float turn_between(const std::array<HalfLanes, 2>& sides) {
  const HalfLanes turn = normalized(sides[0]) - normalized(sides[1]);
  return std::sqrt(dot(turn, turn));
}

HalfLanes row_of(const std::array<float, 3>& v) { return HalfLanes{v[0], v[1], v[2], 0}; }

std::vector<LaneRow> area_vectors(const FlatMesh& mesh, std::span<const float> positions, ThreadTeam& team) {
  std::vector<LaneRow> vectors(mesh.face_count);
  for_each(mesh.face_count, team, [&](std::size_t f) { vectors[f].row = row_of(area_vector(mesh, positions, f)); });
  return vectors;
}

}  // namespace

RidgeWalks::RidgeWalks(const FlatMesh& mesh, std::span<const float> positions, const std::vector<float>& turns,
                       const std::vector<LaneRow>& along, const Spokes& spokes, ThreadTeam& team)
    : mesh_(mesh),
      positions_(positions),
      turns_(turns),
      along_(along),
      spokes_(spokes),
      of_upload_(area_vectors(mesh, mesh.measured, team)),
      of_result_(area_vectors(mesh, positions, team)) {}

RidgeWalks::Piece RidgeWalks::piece_of(std::size_t edge) const {
  Piece piece;
  for (std::size_t side = 0; side < 2; ++side) {
    const auto face = static_cast<std::size_t>(mesh_.edge_faces[side][edge]);
    piece.upload[side] = of_upload_[face].row;
    piece.result[side] = of_result_[face].row;
  }
  return piece;
}

float RidgeWalks::moved_outwards(const Piece& at, std::size_t vertex) const {
  const HalfLanes outwards = normalized(normalized(at.result[0]) + normalized(at.result[1]));
  return dot(outwards, row_of(vector_at(positions_, vertex)) - row_of(vector_at(mesh_.measured, vertex)));
}

bool RidgeWalks::is_convex(std::size_t edge) const {
  const auto at = [&](FlatIndex vertex) { return row_of(vector_at(positions_, static_cast<std::size_t>(vertex))); };
  const HalfLanes normal = of_result_[static_cast<std::size_t>(mesh_.edge_faces[0][edge])].row;
  return dot(normal, at(mesh_.edge_opposites[1][edge]) - at(mesh_.edge_ends[0][edge])) < 0;
}

std::optional<std::size_t> RidgeWalks::next(std::size_t edge, std::size_t side) const {
  float most = kLeastContinuation;
  std::optional<std::size_t> found;
  spokes_.for_each_beyond(edge, side, along_, [&](std::size_t other, float cosine) {
    if (turns_[other] * cosine > most) {
      most = turns_[other] * cosine;
      found = other;
    }
  });
  return found;
}

/// A walk from an edge, in one direction.
struct RidgeWalks::Walk {
  std::size_t edge, side;  ///< of the edge, where the walk goes on
  bool ended = false;

  /// Adds the next edge to `sum`, its sides where they look as those of `start` do.
  void step(const RidgeWalks& walks, const Piece& start, std::size_t first, Piece& sum) {
    const std::optional<std::size_t> next = walks.next(edge, side);
    ended = !next || *next == first;
    if (ended) return;
    Piece piece = walks.piece_of(*next);
    const auto likeness = [&](std::size_t a, std::size_t b) {
      return dot(normalized(piece.result[a]), normalized(start.result[b]));
    };
    if (likeness(0, 0) + likeness(1, 1) < likeness(1, 0) + likeness(0, 1)) {
      std::swap(piece.upload[0], piece.upload[1]);
      std::swap(piece.result[0], piece.result[1]);
    }
    ended = std::min(likeness(0, 0), likeness(1, 1)) < kLeastLikeness;
    if (ended) return;
    const FlatIndex reached = walks.mesh_.edge_ends[side][edge];
    side = walks.mesh_.edge_ends[0][*next] == reached ? 1 : 0;
    edge = *next;
    for (std::size_t k = 0; k < 2; ++k) {
      sum.upload[k] += piece.upload[k];
      sum.result[k] += piece.result[k];
    }
    sum.moved += walks.moved_outwards(piece, static_cast<std::size_t>(walks.mesh_.edge_ends[side][edge]));
    ++sum.vertices;
  }
};

RidgeWalks::Features RidgeWalks::of_single(float turn) {
  Features features{};
  for (std::size_t k = 0; k < kSteps.size(); ++k) features[3 * k] = features[3 * k + 1] = turn;
  features[kFeatures - 1] = std::log(kOwnVertices);
  return features;
}

RidgeWalks::Features RidgeWalks::features(std::size_t edge) const {
  if (turns_[edge] <= kLeastTurn) return of_single(turns_[edge]);
  const Piece start = piece_of(edge);
  Piece sum = start;
  for (const auto& end : mesh_.edge_ends) sum.moved += moved_outwards(start, static_cast<std::size_t>(end[edge]));
  sum.vertices = kOwnVertices;
  const float sharper = is_convex(edge) ? 1 : -1;
  std::array<Walk, 2> walks{{{edge, 0}, {edge, 1}}};
  Features features{};
  std::size_t step = 0, next = 0;
  for (const std::size_t steps : kSteps) {
    for (; step < steps; ++step) {
      for (Walk& walk : walks) {
        if (!walk.ended) walk.step(*this, start, edge, sum);
      }
    }
    if (sum.vertices == kOwnVertices) return of_single(turns_[edge]);
    features[next++] = turn_between(sum.upload);
    features[next++] = turn_between(sum.result);
    features[next++] = sharper * sum.moved / sum.vertices;
  }
  features[next] = std::log(sum.vertices);
  return features;
}

}  // namespace crease
