#include "core/smooth/automatic.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "core/base/state_archive.h"
#include "core/base/stopwatch.h"
#include "core/choice/choice.h"
#include "core/choice/families.h"
#include "core/choice/first_sight.h"
#include "core/choice/scan.h"
#include "core/choice/spikes.h"
#include "core/choice/uncertainty.h"
#include "core/geometry/renumbering.h"
#include "core/graduated/descent.h"
#include "core/smooth/refinement.h"
#include "core/smooth/run_state.h"

namespace crease {
namespace {

/// Stages of a usual run, which progress is measured in; runs may take fewer or more. Where noise may be correlated,
/// the telling settings for scans come first.
constexpr std::uint32_t kUsualStages = 16, kStagesOfSolve = GraduatedOptions{}.stages;
constexpr std::uint32_t kStagesOfTrial = kStagesOfSolve * kTellingScanSettings.size();
/// That labels of snapshots are for, in ℓ.
constexpr double kUsualNoise = 0.2;

/// The words of `surface`, but for "estimated", are those that families of potentials go by.
constexpr bool surfaces_have_settings() {
  constexpr auto kWords = words_of(SurfaceOption{});
  const auto has_settings = [](std::string_view word) {
    return std::ranges::any_of(kSettings, [&](const Setting& setting) { return setting.family.name == word; });
  };
  const auto is_word = [&](const Setting& setting) {
    return std::ranges::find(kWords, setting.family.name) != kWords.end();
  };
  return std::all_of(kWords.begin() + 1, kWords.end(), has_settings) && std::ranges::all_of(kSettings, is_word);
}
static_assert(surfaces_have_settings());

/// Thrown by a solve when the caller has had enough.
struct Cancelled {};

ChoiceOptions choice_options(const MrfOptions& options) {
  ChoiceOptions choice;
  choice.strength = options.strength;
  choice.seed = options.seed;
  choice.wants_risk = options.uncertainty;
  if (options.noise_sigma > 0) choice.noise_sigma = options.noise_sigma;
  if (options.noise == NoiseOption::kNormal) choice.noise_direction = NoiseDirection::kNormal;
  if (options.noise == NoiseOption::kIsotropic) choice.noise_direction = NoiseDirection::kIsotropic;
  choice.correlated = options.noise == NoiseOption::kCorrelated;
  if (options.surface != SurfaceOption::kEstimated) {
    choice.surface = words_of(SurfaceOption{}).at(static_cast<std::size_t>(options.surface));
  }
  return choice;
}

void exchange(StateArchive& archive, std::size_t vertices, GraduatedResult& result) {
  result.positions.resize(3 * vertices);
  result.vertex_normals.resize(3 * vertices);
  archive.values(result.positions);
  archive.values(result.vertex_normals);
  LatentVariance& latent = result.latent;
  archive.value(latent.impulsive);
  for (double* number : {&latent.kurtosis, &latent.small_variance, &latent.large_variance, &latent.small_share}) {
    archive.value(*number);
  }
  archive.values_or_none(latent.precision, vertices);
  archive.values_or_none(latent.relative_variance, vertices);
  archive.value(result.energy);
}

/// Where a stage ends that another one follows.
struct StageEnd {
  FlatVectors positions;
  LbfgsStep last_step;
};

void exchange(StateArchive& archive, std::size_t vertices, StageEnd& end) {
  end.positions.resize(3 * vertices);
  archive.values(end.positions);
  archive.values_or_none(end.last_step.step, 3 * vertices);
  archive.values_or_none(end.last_step.change, 3 * vertices);
}

/// Of vertices that stay as they were measured: that of the noise.
std::vector<double> deviations_of_upload(const Mesh& measured, const Topology& topology, const MrfOptions& options) {
  const Surface surface(measured, topology);
  const ChoiceOptions choice = choice_options(options);
  const FirstSight sight = look_at(surface, choice.noise_sigma, choice.noise_direction, calling_thread());
  return std::vector<double>(measured.positions.size(), surface.unit * sight.sigma);
}

/// A run of solves, each in stages. It keeps the results of its solves for checkpoints. A run that goes on from a
/// checkpoint takes the results in it, in the same order, instead of solving again.
class AutomaticRun {
 public:
  AutomaticRun(const Mesh& measured, const Topology& topology, const MrfOptions& options, std::uint32_t threads,
               RunContext& context, std::span<const double> weights)
      : topology_(topology),
        team_(threads, measured.triangles.size()),
        renumbering_(measured, team_),
        renumbered_(renumbering_, topology, team_),
        options_(options),
        context_(context),
        known_(context.checkpoint) {
    for (const double weight : renumbering_.renumbered(weights)) precisions_.push_back(static_cast<float>(weight));
    if (!context.checkpoint.empty()) read_head();
  }

  SmoothResult run() {
    ChoiceReport report;
    report.faces = topology_.face_edges.size();
    if (precisions_.empty()) report.spikes = flatten_spikes(renumbering_.mesh, renumbered_.topology, team_);
    const Surface surface(renumbering_.mesh, renumbered_.topology, team_);
    const FlatMesh mesh(surface, team_);
    surface_ = &surface;
    mesh_ = &mesh;
    try {
      const Solve solve = [&](const SolveRequest& request) { return solved(request); };
      const ChoiceOptions options = choice_options(options_);
      std::optional<NoiseSpectrum> spectrum = correlated_noise(surface, options);
      std::optional<ChoiceResult> found;
      if (spectrum) {
        usual_stages_ = kStagesOfTrial + (options.correlated ? kStagesOfSolve : kUsualStages);
        found = remove_correlated_noise(surface, mesh, precisions_, *spectrum, options, solve, report, team_);
        if (!found) spectrum.reset();
      }
      if (!found) found = choose_and_solve(surface, mesh, precisions_, options, solve, report, team_);
      const ChoiceResult& chosen = *found;
      latest_ = chosen.positions;
      const auto ask = [&] { ask_caller(); };
      const Refined refined = refine(mesh, chosen, report, options_.strength, precisions_, team_, ask);
      ask_caller();
      result_.positions = upload_positions(refined.positions);
      result_.labels = upload_labels(labels_of(mesh, refined, chosen, report, team_));
      ended_.risk = chosen.risk;
      if (options_.uncertainty) find_uncertainty(surface, chosen.positions, report, spectrum, ask);
      result_.choice = std::move(report);
    } catch (const Cancelled&) {
      result_.cancelled = true;
      result_.sigma.clear();
      result_.positions = upload_positions(latest_);
      result_.labels.assign(topology_.edges.size(), 0);
    }
    result_.seconds = seconds();
    return std::move(result_);
  }

 private:
  /// Noise that is correlated over several edges, unless the options say otherwise.
  std::optional<NoiseSpectrum> correlated_noise(const Surface& surface, const ChoiceOptions& options) {
    const bool told = options.noise_direction || options.noise_sigma || options.surface || !precisions_.empty();
    if (surface.faces.size() > kMostFacesOfScan || (told && !options.correlated)) return std::nullopt;
    return find_correlated_noise(surface, options.correlated, team_);
  }

  double seconds() const { return seconds_before_ + stopwatch_.seconds(); }

  /// Keeps what the last of the solves that the result is made of was told.
  void keep_options(const SolveRequest& request) {
    if (!options_.uncertainty || !request.final) return;
    ended_ = {.options = request.options,
              .precisions = {request.precisions.begin(), request.precisions.end()},
              .spectrum = {},
              .seed = options_.seed,
              .risk = {}};
  }

  void find_uncertainty(const Surface& surface, const FlatVectors& positions, const ChoiceReport& report,
                        const std::optional<NoiseSpectrum>& spectrum, const std::function<void()>& on_step) {
    ended_.options.weight = static_cast<float>(report.weight / (options_.strength * options_.strength));
    ended_.spectrum = spectrum;
    const std::vector<double> deviations =
        posterior_deviations(surface, *mesh_, positions, ended_, report, team_, on_step);
    for (const Index v : renumbering_.new_vertex) result_.sigma.push_back(surface.unit * deviations[v]);
  }

  /// Asks the caller after the last solve, and throws where it has had enough.
  void ask_caller() {
    const auto angles = [&] { return present_angles(latest_); };
    if (!shown(angles, [&] { return state_head(solves_, 0) + done_; })) throw Cancelled();
  }

  /// Shows the caller the last record, with what the run has come to. False where it has had enough.
  bool shown(const std::function<std::vector<float>()>& angles, const std::function<std::string()>& checkpoint) {
    if (context_.on_sweep && !result_.sweeps.empty()) {
      const SweepRecord& record = result_.sweeps.back();
      const auto positions = [&] { return upload_positions(latest_); };
      const auto now_labelled = [&] { return upload_labels(labels_of_angles(angles(), kUsualNoise)); };
      const std::uint32_t total = std::max(usual_stages_, record.sweep + 1);
      if (!context_.on_sweep({record, total, seconds(), now_labelled, positions, checkpoint, {}, fraction_}))
        return false;
    }
    return !context_.cancel.load();
  }

  GraduatedResult solved(const SolveRequest& request) {
    keep_options(request);
    if (known_solves_ > 0) return take_known(request.mesh.vertex_count);
    GraduatedDescent descent(request.mesh, request.measured, request.options, request.precisions, request.latent,
                             team_);
    if (resume_stage_ > 0) {
      if (resume_stage_ >= request.options.stages) throw CheckpointError("the checkpoint is of a run with more stages");
      StageEnd end;
      exchange(known_, request.mesh.vertex_count, end);
      known_.finish();
      descent.resume(std::exchange(resume_stage_, 0), std::move(end.positions), std::move(end.last_step));
    }
    GraduatedResult result = descent.run([&](const StageView& view) { return stage_done(request, view); });
    if (result_.cancelled) throw Cancelled();
    remember(request.mesh.vertex_count, result);
    return result;
  }

  /// Of the whole run. A stage is as much work as it has vertices; before the solve that the result is made of, that
  /// is to come; after it, the regressions and all that follows from the labels take half as long.
  double fraction_after(const SolveRequest& request, int stage) const {
    constexpr double kAfterwards = 0.5 * kStagesOfSolve;
    const auto vertices = static_cast<double>(mesh_->vertex_count), done = static_cast<double>(result_.site_proposals);
    const double to_come = request.final ? request.options.stages - 1 - stage : kStagesOfSolve;
    return done / (done + vertices * (to_come + kAfterwards));
  }

  bool stage_done(const SolveRequest& request, const StageView& view) {
    SweepRecord& record = result_.sweeps.emplace_back();
    record.sweep = static_cast<std::uint32_t>(result_.sweeps.size());
    record.stage = request.final ? kVertexStage : kChoiceStage;
    record.energy.of<LikelihoodTerm>() = view.energy.parts().likelihood;
    record.energy.of<SmoothnessTerm>() = view.energy.parts().smoothness + view.energy.parts().folds;
    record.likelihood_weight = static_cast<double>(view.energy.likelihood);
    const FlatVectors moved = difference(view.positions, request.measured);
    double squares = 0;
    for (const float square : products(moved, moved)) squares += static_cast<double>(square);
    record.rms_displacement = std::sqrt(squares / static_cast<double>(request.mesh.vertex_count));
    const bool whole = &request.mesh == mesh_;
    if (whole) latest_.assign(view.positions.begin(), view.positions.end());
    result_.site_proposals += request.mesh.vertex_count;
    fraction_ = std::max(fraction_, fraction_after(request, view.stage));
    const auto angles = [&] { return whole ? present_angles(view.positions) : std::vector<float>(); };
    result_.cancelled = !shown(angles, [&] { return state(request, view); });
    return !result_.cancelled;
  }

  // --- checkpoints: seconds, records, the solves that are done, the stage of the one that is not ---

  void exchange_records(StateArchive& archive) {
    crease::exchange(archive, result_.sweeps);
    archive.value(result_.site_proposals);
  }

  std::string state_head(std::uint32_t solves, std::int32_t next_stage) {
    StateArchive archive;
    double time = seconds();
    archive.value(time);
    exchange_records(archive);
    archive.value(solves);
    archive.value(next_stage);
    return archive.take_bytes();
  }

  std::string state(const SolveRequest& request, const StageView& view) {
    const bool ends_solve = view.stage + 1 == request.options.stages;
    const std::string head = state_head(solves_ + (ends_solve ? 1 : 0), ends_solve ? 0 : view.stage + 1);
    StateArchive tail;
    FlatVectors positions(view.positions.begin(), view.positions.end());
    if (ends_solve) {
      GraduatedResult result{std::move(positions), view.energy.vertex_normals, view.latent, view.energy.parts()};
      exchange(tail, request.mesh.vertex_count, result);
    } else {
      StageEnd end{std::move(positions), view.last_step};
      exchange(tail, request.mesh.vertex_count, end);
    }
    return head + done_ + tail.take_bytes();
  }

  void read_head() {
    known_.value(seconds_before_);
    exchange_records(known_);
    known_.value(known_solves_);
    known_.value(resume_stage_);
    if (resume_stage_ < 0) throw CheckpointError("the checkpoint names no stage");
    if (known_solves_ == 0 && resume_stage_ == 0) known_.finish();
  }

  GraduatedResult take_known(std::size_t vertices) {
    --known_solves_;
    GraduatedResult result;
    exchange(known_, vertices, result);
    if (known_solves_ == 0 && resume_stage_ == 0) known_.finish();
    remember(vertices, result);
    return result;
  }

  void remember(std::size_t vertices, GraduatedResult& result) {
    ++solves_;
    if (!context_.on_sweep) return;
    StateArchive archive;
    exchange(archive, vertices, result);
    done_ += archive.take_bytes();
  }

  // --- as the upload has it ---

  std::vector<Vec3> upload_positions(const FlatVectors& positions) const {
    const Mesh& mesh = renumbering_.mesh;
    std::vector<Vec3> moved(mesh.positions);
    for (std::size_t v = 0; v < moved.size() && !positions.empty(); ++v) {
      const auto now = vector_at(positions, v), before = vector_at(mesh_->measured, v);
      if (now == before) continue;
      Vec3 place = moved[v];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        place[static_cast<Eigen::Index>(axis)] +=
            surface_->unit * (static_cast<double>(now[axis]) - static_cast<double>(before[axis]));
      }
      if (place.allFinite()) moved[v] = place;
    }
    std::vector<Vec3> result(moved.size());
    for (std::size_t v = 0; v < result.size(); ++v) result[v] = moved[renumbering_.new_vertex[v]];
    return result;
  }

  std::vector<float> present_angles(std::span<const float> positions) {
    return dihedral_angles(*mesh_, positions, team_);
  }

  /// Labels of the mesh's edges as the upload numbers them; 0 for those that are not interior, and for all where there
  /// are no labels.
  std::vector<double> upload_labels(const std::vector<float>& labels) const {
    std::vector<double> of_renumbered(renumbered_.topology.edges.size(), 0);
    for (std::size_t e = 0; e < labels.size(); ++e) {
      of_renumbered[mesh_->topology_edges[e]] = static_cast<double>(labels[e]);
    }
    std::vector<double> result(topology_.edges.size());
    for (std::size_t e = 0; e < result.size(); ++e) result[e] = of_renumbered[renumbered_.new_edge[e]];
    return result;
  }

  const Topology& topology_;
  ThreadTeam team_;
  Renumbering renumbering_;
  RenumberedTopology renumbered_;
  const MrfOptions& options_;
  RunContext& context_;
  Stopwatch stopwatch_;
  double seconds_before_ = 0;
  std::vector<float> precisions_;

  const Surface* surface_ = nullptr;
  const FlatMesh* mesh_ = nullptr;
  SmoothResult result_;
  FlatVectors latest_;  ///< positions of the whole mesh
  std::uint32_t usual_stages_ = kUsualStages;
  double fraction_ = 0;  ///< of the run that is done
  EndedDescent ended_;   ///< with uncertainty

  std::string done_;          ///< solves, as checkpoints have them
  std::uint32_t solves_ = 0;  ///< in `done_`
  StateArchive known_;        ///< of the checkpoint that the run goes on from
  std::uint32_t known_solves_ = 0;
  std::int32_t resume_stage_ = 0;
};

}  // namespace

SmoothResult smooth_automatically(const Mesh& measured, const Topology& topology, const MrfOptions& options,
                                  std::uint32_t threads, RunContext& context, std::span<const double> weights) {
  if (!(options.strength > 0)) {
    SmoothResult unchanged;
    unchanged.positions = measured.positions;
    unchanged.labels.assign(topology.edges.size(), 0);
    if (options.uncertainty) unchanged.sigma = deviations_of_upload(measured, topology, options);
    return unchanged;
  }
  return AutomaticRun(measured, topology, options, threads, context, weights).run();
}

}  // namespace crease
