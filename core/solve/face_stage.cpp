#include <algorithm>

#include "core/solve/annealing.h"
#include "core/solve/face_process.h"
#include "core/solve/step_size.h"
#include "core/solve/vertex_fit.h"

namespace crease {
namespace {

class FaceStage : public Stage {
 public:
  FaceStage(Annealing& annealing, std::uint32_t sweeps)
      : annealing_(annealing),
        options_(annealing.options),
        sweeps_(sweeps),
        schedule_(schedule_faces(annealing.mesh)),
        process_(annealing.field, annealing.terms, options_.normal_weight, options_.corner_weight),
        step_(options_.step_size) {
    process_.measure(annealing.team);
  }

  std::uint32_t sweeps() const override { return sweeps_; }
  std::uint64_t sites() const override { return schedule_.sites.size(); }

  bool sweep(std::uint32_t index, std::uint32_t number, SweepRecord& record) override {
    const std::uint32_t round = round_of(index), first = first_of(round), count = first_of(round + 1) - first;
    const double time = count > 1 ? static_cast<double>(index - first) / (count - 1) : 1.0;
    record.stage = kFaceStage;
    record.likelihood_weight = options_.normal_weight;
    annealing_.label_edges(annealing_.terms.final_weights(), number, time, record);
    process_.labels_changed(annealing_.team);
    propose(number, time, record);
    annealing_.positions_changed();
    annealing_.measure(record);
    record.energy.of<LikelihoodTerm>() = process_.likelihood(annealing_.team);
    record.energy.of<SmoothnessTerm>() = process_.smoothness(annealing_.team);
    if (index + 1 == first + count) end_round(index + 1 == sweeps());
    return true;
  }

  void exchange(StateArchive& archive) override {
    step_.exchange(archive);
    process_.exchange(archive);
  }

 private:
  // Rounds are as equal as they can be, and have a sweep at least.
  std::uint32_t rounds() const { return std::min(options_.rounds, sweeps_); }
  std::uint32_t round_of(std::uint32_t index) const {
    return static_cast<std::uint32_t>(std::uint64_t{index} * rounds() / sweeps());
  }
  std::uint32_t first_of(std::uint32_t round) const {
    return static_cast<std::uint32_t>((std::uint64_t{round} * sweeps() + rounds() - 1) / rounds());
  }

  void propose(std::uint32_t number, double time, SweepRecord& record) {
    record.temperature = scheduled(options_.normal_temperature_start, options_.normal_temperature_end, time);
    record.step_size = step_.value();
    const CounterRandom random(options_.seed, RandomStream::kFaceProcess);
    record.acceptance =
        process_.sweep(schedule_, random, number, record.temperature, step_.value(), annealing_.team).acceptance();
    step_.adapt(record.acceptance);
  }

  /// The normals of the fitted mesh are the measured ones of the next round.
  void end_round(bool last) {
    Field& field = annealing_.field;
    const auto normal = [&](Index f) { return Vec3(field.normals[f].head<3>().cast<double>()); };
    fit_vertices(
        field, options_.fit_steps, normal, [](std::size_t) { return true; }, annealing_.team);
    field.update_normals(annealing_.team);
    annealing_.positions_changed();
    process_.measure(annealing_.team);
    if (!last) annealing_.restart_average();
  }

  Annealing& annealing_;
  const MrfOptions& options_;
  std::uint32_t sweeps_;
  Schedule schedule_;
  FaceProcess process_;
  StepSize step_;
};

}  // namespace

std::unique_ptr<Stage> make_face_stage(Annealing& annealing, std::uint32_t sweeps) {
  return std::make_unique<FaceStage>(annealing, sweeps);
}

}  // namespace crease
