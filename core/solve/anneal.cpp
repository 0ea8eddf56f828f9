#include "core/solve/anneal.h"

#include <algorithm>
#include <memory>

#include "core/base/stopwatch.h"
#include "core/geometry/renumbering.h"
#include "core/solve/annealing.h"

namespace crease {
namespace {

template <typename Value>
std::vector<Value> gathered(const std::vector<Value>& values, const std::vector<Index>& places) {
  std::vector<Value> result;
  result.reserve(places.size());
  for (const Index place : places) result.push_back(values[place]);
  return result;
}

std::vector<std::unique_ptr<Stage>> make_stages(Annealing& annealing) {
  std::vector<std::unique_ptr<Stage>> stages;
  const auto [process, sweeps] = std::pair(annealing.options.process, annealing.options.sweeps);
  const std::uint32_t face_sweeps = process == Process::kFace ? sweeps : process == Process::kBoth ? sweeps / 2 : 0;
  if (face_sweeps > 0) stages.push_back(make_face_stage(annealing, face_sweeps));
  if (face_sweeps < sweeps) stages.push_back(make_vertex_stage(annealing, sweeps - face_sweeps));
  return stages;
}

/// Where a run stands between two sweeps.
struct Place {
  std::uint32_t stage = 0;
  std::uint32_t sweeps = 0;  ///< of the stage, that have been done
};

void exchange(StateArchive& archive, SweepRecord& record) {
  std::uint8_t face = record.stage == kFaceStage ? 1 : 0;
  archive.value(face);
  record.stage = face == 0 ? kVertexStage : kFaceStage;
  archive.value(record.sweep);
  archive.value(record.energy);
  for (double* number : {&record.likelihood_weight, &record.temperature, &record.label_temperature, &record.step_size,
                         &record.acceptance, &record.label_acceptance, &record.rms_displacement}) {
    archive.value(*number);
  }
  archive.value(record.ridge_edges);
}

void exchange(StateArchive& archive, std::uint32_t most_sweeps, SmoothResult& so_far) {
  auto count = static_cast<std::uint32_t>(so_far.sweeps.size());
  archive.value(count);
  if (count > most_sweeps) throw CheckpointError("the checkpoint is of a run with more sweeps");
  so_far.sweeps.resize(count);
  for (SweepRecord& record : so_far.sweeps) exchange(archive, record);
  archive.value(so_far.site_proposals);
  archive.value(so_far.label_proposals);
}

/// Annealing, its stages one after the other, and where it stands.
class Run {
 public:
  Run(const Mesh& mesh, const Topology& topology, const MrfOptions& options, std::uint32_t threads,
      std::span<const double> weights)
      : annealing_(mesh, topology, options, threads, weights), stages_(make_stages(annealing_)) {}

  const Annealing& annealing() const { return annealing_; }

  bool ended() const { return place_.stage == stages_.size(); }

  const SweepRecord& sweep(SmoothResult& result) {
    Stage& stage = *stages_[place_.stage];
    if (place_.sweeps == 0) annealing_.restart_average();
    SweepRecord& record = result.sweeps.emplace_back();
    record.sweep = static_cast<std::uint32_t>(result.sweeps.size());
    const bool may_gain = stage.sweep(place_.sweeps, record.sweep, record);
    result.site_proposals += stage.sites();
    result.label_proposals += annealing_.edge_sites();
    if (++place_.sweeps == stage.sweeps() || !may_gain) place_ = {place_.stage + 1, 0};
    return record;
  }

  /// `seconds` that the run has taken.
  std::string checkpoint(SmoothResult& so_far, double seconds) {
    StateArchive archive;
    exchange(archive, so_far, seconds);
    return archive.take_bytes();
  }

  /// Returns the seconds that the run had taken. \throw CheckpointError
  double resume(std::string_view bytes, SmoothResult& so_far) {
    StateArchive archive(bytes);
    double seconds = 0;
    exchange(archive, so_far, seconds);
    archive.finish();
    return seconds;
  }

 private:
  void exchange(StateArchive& archive, SmoothResult& so_far, double& seconds) {
    archive.value(seconds);
    archive.value(place_);
    if (place_.stage > stages_.size() || (!ended() && place_.sweeps >= stages_[place_.stage]->sweeps())) {
      throw CheckpointError("the checkpoint is of a run with more sweeps");
    }
    crease::exchange(archive, annealing_.options.sweeps, so_far);
    annealing_.exchange(archive);
    if (!ended()) stages_[place_.stage]->exchange(archive);
  }

  Annealing annealing_;
  std::vector<std::unique_ptr<Stage>> stages_;
  Place place_;
};

}  // namespace

SmoothResult anneal(const Mesh& measured, const Topology& topology, const MrfOptions& options, std::uint32_t threads,
                    RunContext& context, std::span<const double> weights) {
  const Stopwatch stopwatch;
  const Renumbering renumbering(measured);
  const auto [renumbered, edges] = RenumberedTopology(renumbering, topology);
  const std::vector<double> new_weights = renumbering.renumbered(weights);
  Run run(renumbering.mesh, renumbered, options, threads, new_weights);
  const Field& field = run.annealing().field;

  SmoothResult result;
  const double seconds_before = context.checkpoint.empty() ? 0 : run.resume(context.checkpoint, result);
  const auto seconds = [&] { return seconds_before + stopwatch.seconds(); };
  const auto positions = [&] { return gathered(field.upload_positions(renumbering.mesh), renumbering.new_vertex); };
  const auto labels = [&, &edges = edges] { return gathered(field.labels, edges); };
  const auto checkpoint = [&] { return run.checkpoint(result, seconds()); };
  while (!run.ended() && !result.cancelled) {
    const SweepRecord& record = run.sweep(result);
    if (context.on_sweep) {
      result.cancelled = !context.on_sweep({record, options.sweeps, seconds(), labels, positions, checkpoint});
    }
    result.cancelled = result.cancelled || context.cancel.load();
  }
  result.positions = positions();
  result.labels = gathered(run.annealing().expected_labels(), edges);
  result.seconds = seconds();
  return result;
}

}  // namespace crease
