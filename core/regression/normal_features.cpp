#include "core/regression/normal_features.h"

#include <algorithm>
#include <cmath>

#include "core/graduated/fast_math.h"

namespace crease {
namespace {

constexpr float kLeastShareOfArea = 0.02F;  ///< a face counts for no less than this share of the mean area
constexpr float kLeastAveraged = 1e-4F;
constexpr float kLeastExponent = -40;  ///< of weights; far within what fast_exp takes
constexpr float kNoLength = 1e-12F;    ///< of a vector without a direction

/// The averaged normals of a face: x, y, z of the upload, 0, x, y, z of the result, 0.
struct alignas(32) Average {
  Lanes normals;
};
using Averages = std::vector<Average>;

/// What eight faces weigh in a round, and the three faces next to each; the sum is 1.
struct RoundWeights {
  Lanes own;
  LaneArray<3> others;
};

/// Of eight faces: areas, and of the faces next to each, across a side, areas and ‖n_i − n_j‖².
struct Surroundings {
  Lanes area;
  LaneArray<3> areas, squares;
};

float length_of(const std::array<float, 3>& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

/// Zero where there is no direction.
std::array<float, 3> unit_of(const std::array<float, 3>& v) {
  const float length = length_of(v);
  return length > kNoLength ? std::array{v[0] / length, v[1] / length, v[2] / length} : std::array<float, 3>{};
}

/// Two axes that complete a unit vector to a frame [Duff et al. 2017].
FaceFrame frame_of(const std::array<float, 3>& n) {
  const float sign = std::copysign(1.0F, n[2]), a = -1 / (sign + n[2]), b = n[0] * n[1] * a;
  return {n, {1 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]}, {b, sign + n[1] * n[1] * a, -n[1]}};
}

/// Axes of the planes of eight faces.
struct LaneAxes {
  LaneVectors first, second;
};

/// One round of averaging.
CREASE_WIDE_CLONES void average(const FlatMesh& mesh, const std::vector<RoundWeights>& weights, const Averages& before,
                                Averages& after, std::size_t begin, std::size_t end) {
  for (std::size_t f = begin; f < end; ++f) {
    const RoundWeights& of_block = weights[f / kLaneCount];
    const std::size_t lane = f % kLaneCount;
    Lanes sum = of_block.own[lane] * before[f].normals;
    for (std::size_t k = 0; k < 3; ++k) {
      sum += of_block.others[k][lane] * before[static_cast<std::size_t>(mesh.neighbors[k][f])].normals;
    }
    after[f].normals = sum;
  }
}

/// What blocks of eight faces weigh, where `factor` of the squares is the exponent.
CREASE_WIDE_CLONES void weigh_blocks(const std::vector<Surroundings>& surroundings, float factor,
                                     std::vector<RoundWeights>& weights, std::size_t begin, std::size_t end) {
  for (std::size_t block = begin; block < end; ++block) {
    const Surroundings& around = surroundings[block];
    RoundWeights& of_block = weights[block];
    Lanes sum = around.area;
    for (std::size_t k = 0; k < 3; ++k) {
      const Lanes exponent = factor * around.squares[k];
      of_block.others[k] = around.areas[k] * fast_exp(exponent > kLeastExponent ? exponent : kLeastExponent + Lanes{});
      sum += of_block.others[k];
    }
    for (std::size_t k = 0; k < 3; ++k) of_block.others[k] /= sum;
    of_block.own = around.area / sum;
  }
}

/// Directions of averages within the planes of eight faces, as vector `item`; returns their lengths.
CREASE_LANES_INLINE Lanes put_directions(const LaneVectors& averages, const LaneAxes& axes, std::size_t item,
                                         NormalFeatures& features) {
  const Lanes length = sqrt(averages.squared_norm()), inverse = length > kNoLength ? 1 / length : Lanes{};
  features.x[item].store(inverse * dot(averages, axes.first));
  features.y[item].store(inverse * dot(averages, axes.second));
  return length;
}

/// How much is averaged out where an average has this length.
CREASE_LANES_INLINE Lanes log_averaged_out(const Lanes& length) {
  const Lanes averaged_out = length < 1 ? 1 - length : Lanes{};
  return fast_log(kLeastAveraged + averaged_out);
}

/// Averages number `next` and `next + 1`, of the upload and of the result, of blocks of eight faces.
CREASE_WIDE_CLONES void put_averages(const Averages& averages, const std::vector<LaneAxes>& axes, std::size_t next,
                                     std::vector<NormalFeatures>& features, std::size_t begin, std::size_t end) {
  for (std::size_t block = begin; block < end; ++block) {
    const Average* rows = averages.data() + block * NormalFeatures::kFaces;
    const std::array<LaneVectors, 2> sources{transposed([&](std::size_t k) { return low(rows[k].normals); }),
                                             transposed([&](std::size_t k) { return high(rows[k].normals); })};
    for (std::size_t source = 0; source < sources.size(); ++source) {
      NormalFeatures& of_block = features[block];
      const Lanes length = put_directions(sources[source], axes[block], next + source + 1, of_block);
      of_block.scalars[next + source].store(log_averaged_out(length));
    }
  }
}

/// Average number `item` of the reference, of blocks of eight faces.
CREASE_WIDE_CLONES void put_reference(const Averages& averages, const std::vector<LaneAxes>& axes, std::size_t item,
                                      std::vector<NormalFeatures>& features, std::size_t begin, std::size_t end) {
  constexpr std::size_t kFirstVector = NormalFeatures::kVectors - NormalFeatures::kReferenceRounds.size(),
                        kFirstScalar = NormalFeatures::kScalars - NormalFeatures::kReferenceRounds.size();
  for (std::size_t block = begin; block < end; ++block) {
    const Average* rows = averages.data() + block * NormalFeatures::kFaces;
    const Lanes length = put_directions(transposed([&](std::size_t k) { return low(rows[k].normals); }), axes[block],
                                        kFirstVector + item, features[block]);
    if (item > 0) features[block].scalars[kFirstScalar + item].store(log_averaged_out(length));
  }
}

class Gathering {
 public:
  Gathering(const FlatMesh& mesh, std::span<const float> positions, ThreadTeam& team)
      : mesh_(mesh),
        team_(team),
        areas_(mesh.face_count),
        features_(mesh.face_blocks()),
        weights_(features_.size()),
        surroundings_(features_.size()),
        axes_(features_.size()),
        normals_(NormalFeatures::kFaces * features_.size()) {
    for_each_face([&](std::size_t f) {
      const auto now = area_vector(mesh, positions, f), before = unit_of(area_vector(mesh, mesh.measured, f));
      const auto n = unit_of(now);
      areas_[f] = length_of(now);
      set_axes(f, frame_of(n));
      normals_[f].normals = Lanes{before[0], before[1], before[2], 0, n[0], n[1], n[2], 0};
    });
    const auto count = static_cast<double>(std::max<std::size_t>(1, mesh.face_count));
    mean_area_ = static_cast<float>(
        block_sum<double>(mesh.face_count, team, [&](std::size_t f) { return static_cast<double>(areas_[f]); }) /
        count);
    for_each_face([&](std::size_t f) { areas_[f] = std::max(areas_[f], kLeastShareOfArea * mean_area_); });
    for_each_face([&](std::size_t f) { look_around(f); });
  }

  std::vector<NormalFeatures> gathered(std::span<const float> reference, const DescentSight& sight) {
    for_each_block([&](std::size_t begin, std::size_t end) {
      for (std::size_t block = begin; block < end; ++block) put_upload(block);
    });
    std::size_t next = 0;
    for (const NormalFeatures::Averaging& averaging : NormalFeatures::kAveragings) {
      weigh(averaging.width);
      average_in_rounds(normals_, averaging.rounds, [&](const Averages& now) {
        for_each_block(
            [&](std::size_t begin, std::size_t end) { put_averages(now, axes_, next, features_, begin, end); });
        next += 2;
      });
    }
    gather_reference(reference);
    const auto told = sight.features();
    for_each_block([&](std::size_t begin, std::size_t end) {
      for (std::size_t block = begin; block < end; ++block) {
        for (std::size_t k = 0; k < told.size(); ++k) features_[block].scalars[next + k].store(told[k] + Lanes{});
        features_[block].scalars[next + told.size()].store(log_areas(block));
      }
    });
    return std::move(features_);
  }

 private:
  template <typename Body>
  void for_each_face(Body body) {
    for_each(mesh_.face_count, team_, body);
  }

  template <typename Body>
  void for_each_block(Body body) {
    team_.run(features_.size(), kChunk / NormalFeatures::kFaces,
              [&](std::size_t begin, std::size_t end, std::size_t) { body(begin, end); });
  }

  /// Hands over what averaging comes to after each of the numbers of rounds, up to a 0 that is not the first.
  template <std::size_t count, typename Visit>
  void average_in_rounds(Averages now, const std::array<int, count>& numbers, Visit visit) {
    Averages before(now.size());
    int round = 0;
    for (std::size_t i = 0; i < count && (i == 0 || numbers[i] > 0); ++i) {
      for (; round < numbers[i]; ++round) {
        now.swap(before);
        team_.run(mesh_.face_count, kChunk, [&](std::size_t begin, std::size_t end, std::size_t) {
          average(mesh_, weights_, before, now, begin, end);
        });
      }
      visit(now);
    }
  }

  void gather_reference(std::span<const float> reference) {
    Averages normals(normals_.size());
    for_each_face([&](std::size_t f) {
      const Lanes& own = normals_[f].normals;
      const auto n = reference.empty() ? std::array{own[4], own[5], own[6]} : vector_at(reference, f);
      normals[f].normals = Lanes{n[0], n[1], n[2]};
    });
    weigh(NormalFeatures::kReferenceWidth);
    std::size_t item = 0;
    average_in_rounds(std::move(normals), NormalFeatures::kReferenceRounds, [&](const Averages& now) {
      for_each_block(
          [&](std::size_t begin, std::size_t end) { put_reference(now, axes_, item, features_, begin, end); });
      ++item;
    });
  }

  void set_axes(std::size_t face, const FaceFrame& frame) {
    LaneAxes& axes = axes_[face / NormalFeatures::kFaces];
    const std::size_t lane = face % NormalFeatures::kFaces;
    const auto set = [lane](LaneVectors& lanes, const std::array<float, 3>& axis) {
      lanes.x[lane] = axis[0];
      lanes.y[lane] = axis[1];
      lanes.z[lane] = axis[2];
    };
    set(axes.first, frame.first);
    set(axes.second, frame.second);
  }

  void put_upload(std::size_t block) {
    const Average* rows = normals_.data() + block * NormalFeatures::kFaces;
    put_directions(transposed([&](std::size_t k) { return low(rows[k].normals); }), axes_[block], 0, features_[block]);
  }

  /// Of a block, over the mean; 0 for lanes without a face.
  Lanes log_areas(std::size_t block) const {
    Lanes ratios = 1 + Lanes{};
    for (std::size_t k = 0; k < NormalFeatures::kFaces && mean_area_ > 0; ++k) {
      const std::size_t face = block * NormalFeatures::kFaces + k;
      if (face < areas_.size()) ratios[k] = areas_[face] / mean_area_;
    }
    return fast_log(ratios);
  }

  void look_around(std::size_t face) {
    Surroundings& around = surroundings_[face / NormalFeatures::kFaces];
    const std::size_t lane = face % NormalFeatures::kFaces;
    around.area[lane] = areas_[face];
    for (std::size_t k = 0; k < 3; ++k) {
      const auto other = static_cast<std::size_t>(mesh_.neighbors[k][face]);
      const HalfLanes turn = high(normals_[face].normals) - high(normals_[other].normals);
      around.areas[k][lane] = other == face ? 0 : areas_[other];
      around.squares[k][lane] = dot(turn, turn);
    }
  }

  void weigh(float width) {
    const float factor = -0.5F / (width * width);
    for_each_block(
        [&](std::size_t begin, std::size_t end) { weigh_blocks(surroundings_, factor, weights_, begin, end); });
  }

  const FlatMesh& mesh_;
  ThreadTeam& team_;
  std::vector<float> areas_;
  float mean_area_ = 0;
  // Per block:
  std::vector<NormalFeatures> features_;
  std::vector<RoundWeights> weights_;
  std::vector<Surroundings> surroundings_;
  std::vector<LaneAxes> axes_;
  Averages normals_;  ///< as many as there are lanes
};

}  // namespace

std::array<float, DescentSight::kFeatures> DescentSight::features() const {
  constexpr double kLeast = 1e-3;
  const auto logarithm = [kLeast](double x) { return static_cast<float>(std::log(std::max(x, kLeast))); };
  return {logarithm(noise_sigma), static_cast<float>(correlation_length), static_cast<float>(isotropy),
          static_cast<float>(exponent), logarithm(weight)};
}

FaceFrame face_frame(const FlatMesh& mesh, std::span<const float> positions, std::size_t face) {
  return frame_of(unit_of(area_vector(mesh, positions, face)));
}

FlatVectors face_normals(const FlatMesh& mesh, std::span<const float> positions, ThreadTeam& team) {
  FlatVectors normals(3 * mesh.face_count);
  for_each(mesh.face_count, team,
           [&](std::size_t f) { set_vector(normals, f, unit_of(area_vector(mesh, positions, f))); });
  return normals;
}

std::vector<NormalFeatures> normal_features(const FlatMesh& mesh, std::span<const float> positions,
                                            std::span<const float> reference, const DescentSight& sight,
                                            ThreadTeam& team) {
  return Gathering(mesh, positions, team).gathered(reference, sight);
}

}  // namespace crease
