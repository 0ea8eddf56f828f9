#include "core/smooth/apart.h"

#include <algorithm>
#include <functional>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "core/base/state_archive.h"
#include "core/mesh/mesh_parts.h"
#include "core/smooth/automatic.h"
#include "core/smooth/run_state.h"

namespace crease {
namespace {

/// Over their mean; 0 where all are 0.
std::vector<double> relative(std::span<const double> weights) {
  const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
  const double mean = sum / static_cast<double>(weights.size());
  std::vector<double> all(weights.begin(), weights.end());
  for (double& weight : all) weight = mean > 0 ? weight / mean : 0;
  return all;
}

/// One part after the other. While it lives, the caller sees sweeps of a part as sweeps of the whole.
class ApartRun {
 public:
  ApartRun(const Mesh& measured, const Topology& topology, const std::vector<MeshPart>& parts,
           const MrfOptions& options, std::uint32_t threads, RunContext& context, std::span<const double> weights)
      : parts_(parts),
        options_(options),
        threads_(threads),
        context_(context),
        on_sweep_(std::move(context.on_sweep)),
        checkpoint_(context.checkpoint),
        weights_(weights),
        unit_(mean_edge_length(measured.positions, topology.edges)),
        faces_(measured.triangles.size()) {
    result_.positions = measured.positions;
    result_.labels.assign(topology.edges.size(), 0);
    if (options.uncertainty) result_.sigma.assign(measured.positions.size(), 0);
    context_.on_sweep = nullptr;
  }
  ~ApartRun() {
    context_.on_sweep = std::move(on_sweep_);
    context_.checkpoint = checkpoint_;
  }
  ApartRun(const ApartRun&) = delete;
  ApartRun& operator=(const ApartRun&) = delete;

  SmoothResult run() {
    context_.checkpoint = take_known(checkpoint_);
    for (std::size_t i = done_.size(); i < parts_.size() && !result_.cancelled; ++i) {
      if (on_sweep_) context_.on_sweep = [this, i](const SweepView& view) { return on_sweep_(shown(view, i)); };
      add(i, smoothed(i));
      context_.checkpoint = {};
    }
    if (result_.cancelled) result_.sigma.clear();
    return std::move(result_);
  }

 private:
  /// The caller gives and gets lengths in ℓ of the whole; the run of a part has them in ℓ of the part.
  SmoothResult smoothed(std::size_t i) {
    const MeshPart& part = parts_[i];
    const Topology topology = build_topology(part.mesh);
    part_unit_ = mean_edge_length(part.mesh.positions, topology.edges) / unit_;
    MrfOptions options = options_;
    options.noise_sigma /= part_unit_;
    std::vector<double> weights;
    if (!weights_.empty()) {
      for (const Index v : part.vertices) weights.push_back(weights_[v]);
    }
    SmoothResult result = smooth_automatically(part.mesh, topology, options, threads_, context_, weights);
    if (result.choice) {
      result.choice->noise_sigma *= part_unit_;
      result.choice->noise_sigma_first *= part_unit_;
    }
    for (SweepRecord& record : result.sweeps) record.rms_displacement *= part_unit_;
    return result;
  }

  void add(std::size_t i, SmoothResult of_part) {
    StateArchive archive;
    if (on_sweep_ && !of_part.cancelled) exchange(archive, parts_[i], of_part);
    done_.push_back(archive.take_bytes());
    place(parts_[i].vertices, of_part.positions, result_.positions);
    place(parts_[i].edges, of_part.labels, result_.labels);
    if (!of_part.sigma.empty()) place(parts_[i].vertices, of_part.sigma, result_.sigma);
    const auto before = static_cast<std::uint32_t>(result_.sweeps.size());
    for (SweepRecord& record : of_part.sweeps) {
      record.sweep += before;
      result_.sweeps.push_back(record);
    }
    result_.site_proposals += of_part.site_proposals;
    result_.seconds += of_part.seconds;
    result_.cancelled = of_part.cancelled;
    faces_done_ += parts_[i].mesh.triangles.size();
    if (!of_part.choice) return;
    if (i == 0) {
      result_.choice = std::move(of_part.choice);
    } else {
      result_.other_choices.push_back(*std::move(of_part.choice));
    }
  }

  template <typename Item>
  static void place(const std::vector<Index>& places, const std::vector<Item>& items, std::vector<Item>& all) {
    for (std::size_t k = 0; k < places.size(); ++k) all[places[k]] = items[k];
  }

  /// What the caller sees of a run of part `i`.
  SweepView shown(const SweepView& view, std::size_t i) {
    record_ = view.record;
    record_.sweep += static_cast<std::uint32_t>(result_.sweeps.size());
    record_.rms_displacement *= part_unit_;
    SweepView all{record_,
                  static_cast<std::uint32_t>(result_.sweeps.size()) + view.sweeps,
                  result_.seconds + view.seconds,
                  {},
                  {}};
    all.labels = [&, i] {
      std::vector<double> labels = result_.labels;
      place(parts_[i].edges, view.labels(), labels);
      return labels;
    };
    all.positions = [&, i] {
      std::vector<Vec3> positions = result_.positions;
      place(parts_[i].vertices, view.positions(), positions);
      return positions;
    };
    all.checkpoint = [&] { return state(view.checkpoint()); };
    const auto faces = static_cast<double>(parts_[i].mesh.triangles.size());
    all.fraction = (static_cast<double>(faces_done_) + faces * view.fraction.value_or(0)) / static_cast<double>(faces_);
    return all;
  }

  // --- checkpoints: how many parts are done, what has become of each, the checkpoint of the next ---

  static void exchange(StateArchive& archive, const MeshPart& part, SmoothResult& result) {
    result.positions.resize(part.vertices.size());
    result.labels.resize(part.edges.size());
    archive.values(result.positions);
    archive.values(result.labels);
    archive.values_or_none(result.sigma, part.vertices.size());
    crease::exchange(archive, result.sweeps);
    archive.value(result.site_proposals);
    archive.value(result.seconds);
    std::uint8_t has_choice = result.choice ? 1 : 0;
    archive.value(has_choice);
    if (has_choice != 0) crease::exchange(archive, result.choice ? *result.choice : result.choice.emplace());
  }

  std::string state(const std::string& of_part) const {
    StateArchive head;
    auto count = static_cast<std::uint32_t>(done_.size());
    head.value(count);
    std::string bytes = head.take_bytes();
    for (const std::string& done : done_) bytes += done;
    return bytes + of_part;
  }

  /// Takes the parts that are done from a checkpoint; returns that of the next one.
  std::string_view take_known(std::string_view checkpoint) {
    if (checkpoint.empty()) return {};
    StateArchive known(checkpoint);
    std::uint32_t count = 0;
    known.value(count);
    if (count >= parts_.size()) throw CheckpointError("the checkpoint is one of a mesh with more parts");
    for (std::size_t i = 0; i < count; ++i) {
      SmoothResult result;
      exchange(known, parts_[i], result);
      add(i, std::move(result));
    }
    return known.rest();
  }

  const std::vector<MeshPart>& parts_;
  const MrfOptions& options_;
  std::uint32_t threads_;
  RunContext& context_;
  std::function<bool(const SweepView&)> on_sweep_;  ///< the caller's
  std::string_view checkpoint_;                     ///< the caller's
  std::span<const double> weights_;
  double unit_;           ///< ℓ of the whole
  std::size_t faces_;     ///< of the whole
  double part_unit_ = 1;  ///< ℓ of the part that is smoothed, over that of the whole

  SmoothResult result_;
  SweepRecord record_;             ///< the last one that the caller saw
  std::vector<std::string> done_;  ///< parts, as checkpoints have them; empty where nobody asks for any
  std::size_t faces_done_ = 0;
};

}  // namespace

SmoothResult smooth_apart(const Mesh& measured, const Topology& topology, const MrfOptions& options,
                          std::uint32_t threads, RunContext& context, std::span<const double> weights) {
  const std::vector<double> relative_weights = relative(weights);
  const std::vector<MeshPart> parts = parts_of(measured, topology);
  if (parts.empty()) return smooth_automatically(measured, topology, options, threads, context, relative_weights);
  return ApartRun(measured, topology, parts, options, threads, context, relative_weights).run();
}

}  // namespace crease
