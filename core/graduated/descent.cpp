#include "core/graduated/descent.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/graduated/lbfgs.h"
#include "core/graduated/sampling.h"

namespace crease {
namespace {

constexpr float kScaleStart = 0.1F, kFadingAreaEnd = 1e-3F;
constexpr float kLargestArea = 0.9F;     ///< a face need not have more than a share of this
constexpr double kLeastVariance = 5e-4;  ///< of the latent variances, relative to the noise
constexpr int kLatentStages = 3;         ///< the last ones
constexpr int kWideNormalRounds = 3;     ///< of smoothing vertex normals in the first half; then one

float geometric(float start, float end, float time) {
  return std::exp(std::log(start) * (1 - time) + std::log(end) * time);
}

float mean_square_floor(const GraduatedOptions& options) {
  return static_cast<float>(kLeastVariance) * options.variance;
}

/// The multiple of a quarter nearest to `x`.
float in_quarters(float x) { return std::round(4 * x) / 4; }

}  // namespace

GraduatedDescent::GraduatedDescent(const FlatMesh& mesh, std::span<const float> measured,
                                   const GraduatedOptions& options, std::span<const float> precisions,
                                   std::span<const float> latent, ThreadTeam& team)
    : mesh_(mesh),
      measured_(measured),
      given_precisions_(precisions),
      given_latent_(latent),
      options_(options),
      team_(team),
      energy_(mesh, measured),
      positions_(measured.begin(), measured.end()),
      area_vectors_(3 * mesh.face_count) {
  if (!precisions.empty()) energy_.precisions.assign(precisions.begin(), precisions.end());
}

void GraduatedDescent::resume(int stage, FlatVectors positions, LbfgsStep last_step) {
  first_stage_ = stage;
  positions_ = std::move(positions);
  memory_.last = std::move(last_step);
}

GraduatedResult GraduatedDescent::run(const StageObserver& observer) {
  const DifferentiableFunction function = [&](std::span<const float> x, std::span<float> gradient) {
    return energy_(x, gradient, team_);
  };
  LbfgsOptions search;
  search.steps = options_.steps;
  search.goes_on = options_.goes_on;
  search.on_start = [&] { update_metric(); };
  if (options_.metric != nullptr) {
    search.least_gain = 1e-4;
    search.longest_move = 0.5F;
    search.solve = [&](std::span<float> step) { options_.metric->solve(step); };
  } else {
    search.least_gain = 3e-5;
    search.diagonal = &inverse_curvatures_;
  }
  for (int stage = first_stage_; stage < options_.stages; ++stage) {
    begin_stage(stage);
    minimize(function, positions_, search, team_, memory_);
    if (observer && !observer({stage, energy_, positions_, latent_, memory_.last})) break;
  }
  return {positions_, energy_.vertex_normals, latent_, energy_.parts()};
}

void GraduatedDescent::update_metric() {
  if (options_.metric == nullptr) {
    inverse_curvatures_ = energy_.inverse_curvatures(positions_, team_);
    return;
  }
  std::vector<double> diagonal;
  for (const float precision : energy_.precisions) {
    diagonal.push_back(2 * static_cast<double>(energy_.likelihood * precision));
  }
  options_.metric->factorize(positions_, energy_.stiffness(positions_), diagonal, energy_.fading_area);
}

void GraduatedDescent::begin_stage(int stage) {
  const float time = std::min(1.0F, static_cast<float>(stage) / static_cast<float>(std::max(1, options_.stages - 2)));
  const PotentialFamily& family = options_.family;
  energy_.fading_area = geometric(options_.fading_area_start, kFadingAreaEnd, time);
  energy_.exponent = in_quarters(family.exponent_start + (family.exponent_end - family.exponent_start) * time);
  energy_.across = options_.across <= 1 ? options_.across
                                        : std::max(std::min(options_.across_start, options_.across),
                                                   std::pow(options_.across, std::max(0.0F, 1.5F * time - 0.5F)));
  energy_.fold_weight = options_.fold_weight;
  energy_.likelihood = options_.weight / options_.variance * std::pow(family.ramp, 1 - time);
  energy_.measured = measured_;
  if (stage >= family.diffuses_from) {
    smoothed_ = positions_;
    energy_.measured = smoothed_;
  }
  update_normals();
  for (int round = 0; round < (time < 0.5F ? kWideNormalRounds : 1); ++round) {
    const std::size_t count = mesh_.vertex_count;
    const FlatVectors before = energy_.vertex_normals;
    for_each(count, team_, [&](std::size_t v) {
      for (const Index other : mesh_.vertex_neighbors[v]) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
          energy_.vertex_normals[axis * count + v] += before[axis * count + other];
        }
      }
    });
  }
  update_references();
  update_scales(geometric(kScaleStart, family.scale, time));
  update_precisions(stage);
  if (options_.irregularity > 0) even_sampling();
}

/// Area vectors of the faces, and their sums around vertices.
void GraduatedDescent::update_normals() {
  const std::size_t faces = mesh_.face_count, count = mesh_.vertex_count;
  for_each(faces, team_, [&](std::size_t f) { set_vector(area_vectors_, f, area_vector(mesh_, positions_, f)); });
  for_each(count, team_, [&](std::size_t v) {
    std::array<float, 3> sum{};
    for (const Index place : mesh_.vertex_corners[v]) {
      const auto normal = vector_at(area_vectors_, place / 3);
      for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += normal[axis];
    }
    set_vector(energy_.vertex_normals, v, sum);
  });
}

/// Unit vertex normals, and from them which way faces look and how much of their area must be seen from there.
void GraduatedDescent::update_references() {
  const std::size_t faces = mesh_.face_count, count = mesh_.vertex_count;
  FlatVectors& normals = energy_.vertex_normals;
  for_each(count, team_, [&](std::size_t v) {
    const auto n = vector_at(normals, v);
    const float length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    if (length > 0) {
      for (std::size_t axis = 0; axis < 3; ++axis) normals[axis * count + v] /= length;
    }
  });
  std::vector<float> seen(faces);
  for_each(faces, team_, [&](std::size_t f) {
    std::array<float, 3> r{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto normal = vector_at(normals, static_cast<std::size_t>(mesh_.corners[k][f]));
      for (std::size_t axis = 0; axis < 3; ++axis) r[axis] += normal[axis];
    }
    const float scale = 1 / std::sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2] + 1e-20F);
    const auto area = vector_at(area_vectors_, f);
    float product = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      r[axis] *= scale;
      product += r[axis] * area[axis];
    }
    set_vector(energy_.face_references, f, r);
    seen[f] = std::max(0.0F, product);
  });
  std::vector<float> around(count);
  for_each(count, team_, [&](std::size_t v) {
    float sum = 0;
    for (const Index place : mesh_.vertex_corners[v]) sum += seen[place / 3];
    around[v] = sum / static_cast<float>(std::max<std::size_t>(1, mesh_.vertex_corners[v].size()));
  });
  for_each(faces, team_, [&](std::size_t f) {
    float mean = 0;
    for (std::size_t k = 0; k < 3; ++k) mean += around[static_cast<std::size_t>(mesh_.corners[k][f])] / 3;
    energy_.least_areas[f] = options_.fold_area * std::min(mean, kLargestArea);
  });
}

/// Weights and scales of the edges from how much their surroundings bend.
void GraduatedDescent::update_scales(float scale) {
  const std::size_t edges = mesh_.edge_count, faces = mesh_.face_count;
  const PotentialFamily& family = options_.family;
  FlatVectors unit(area_vectors_);
  for_each(faces, team_, [&](std::size_t f) {
    const auto n = vector_at(area_vectors_, f);
    const float length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (std::size_t axis = 0; axis < 3; ++axis) unit[axis * faces + f] = length > 0 ? n[axis] / length : 0;
  });
  std::vector<float> lengths(edges), bends(edges);
  const auto at = [](const std::array<std::vector<FlatIndex>, 2>& two, std::size_t side, std::size_t e) {
    return static_cast<std::size_t>(two[side][e]);
  };
  for_each(edges, team_, [&](std::size_t e) {
    const auto a = vector_at(positions_, at(mesh_.edge_ends, 0, e)),
               b = vector_at(positions_, at(mesh_.edge_ends, 1, e));
    const auto n = vector_at(unit, at(mesh_.edge_faces, 0, e)), m = vector_at(unit, at(mesh_.edge_faces, 1, e));
    float square = 0, q = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      square += (a[axis] - b[axis]) * (a[axis] - b[axis]);
      q += (n[axis] - m[axis]) * (n[axis] - m[axis]);
    }
    lengths[e] = std::max(kLeastEdge, std::sqrt(square));
    bends[e] = q / (1 + q / family.ridge_cap);
  });
  if (family.local_gain > 0) {
    std::vector<float> mean(mesh_.vertex_count);
    for (int round = 0; round < 2; ++round) {
      for_each(mesh_.vertex_count, team_, [&](std::size_t v) {
        float sum = 0, length = 1e-9F;
        for (const Index e : mesh_.vertex_stencils[v]) {
          sum += lengths[e] * bends[e];
          length += lengths[e];
        }
        mean[v] = sum / length;
      });
      for_each(edges, team_, [&](std::size_t e) {
        bends[e] = (mean[at(mesh_.edge_ends, 0, e)] + mean[at(mesh_.edge_ends, 1, e)]) / 2;
      });
    }
  }
  energy_.set_edges(team_, [&](std::size_t e) -> EdgeTerm {
    const float c = std::sqrt(scale * scale + (family.local_gain > 0 ? family.local_gain * bends[e] : 0));
    return {lengths[e] * (family.local_gain > 0 && family.weight_power == 2 ? kScaleStart / c : 1), c};
  });
}

/// What the stage goes by is moved within the surface to where the sampling is as smooth as it may be.
void GraduatedDescent::even_sampling() {
  const float ratio = options_.variance / (options_.irregularity * options_.irregularity);
  const FlatVectors moves = evening_moves({mesh_, positions_, measured_, energy_.vertex_normals}, ratio, team_);
  const std::span<const float> data = energy_.measured;
  const std::size_t count = mesh_.vertex_count;
  evened_.resize(3 * count);
  for_each(count, team_, [&](std::size_t v) {
    const auto normal = vector_at(energy_.vertex_normals, v);
    float along = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t i = axis * count + v;
      along += (data[i] - positions_[i]) * normal[axis];
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t i = axis * count + v;
      evened_[i] = positions_[i] + moves[i] + along * normal[axis];
    }
  });
  energy_.measured = evened_;
}

void GraduatedDescent::update_precisions(int stage) {
  if (!options_.latent_variance || stage < options_.stages - kLatentStages) return;
  if (!given_latent_.empty()) {
    energy_.precisions.assign(given_latent_.begin(), given_latent_.end());
    return;
  }
  std::vector<float> residuals = products(difference(positions_, measured_), energy_.vertex_normals);
  for (std::size_t v = 0; v < given_precisions_.size(); ++v) residuals[v] *= std::sqrt(given_precisions_[v]);
  latent_ = fit_latent_variance(residuals, static_cast<double>(mean_square_floor(options_)));
  for (std::size_t v = 0; v < given_precisions_.size(); ++v) latent_.precision[v] *= given_precisions_[v];
  energy_.precisions = latent_.precision;
  if (stage >= options_.family.diffuses_from) restore_unmoved();
}

/// Vertices that noise left alone, as latent variances have it, begin a step of a diffusion where they were measured.
void GraduatedDescent::restore_unmoved() {
  const std::size_t count = mesh_.vertex_count;
  for (std::size_t v = 0; v < latent_.relative_variance.size(); ++v) {
    const float share = std::clamp(1 - latent_.relative_variance[v], 0.0F, 1.0F);
    for (std::size_t i = v; i < 3 * count; i += count) smoothed_[i] += share * (measured_[i] - smoothed_[i]);
  }
}

}  // namespace crease
