#include "core/solve/annealing.h"
#include "core/solve/descent.h"
#include "core/solve/step_size.h"
#include "core/solve/vertex_process.h"

namespace crease {
namespace {

std::vector<std::uint8_t> fixed_vertices(const Annealing& annealing) {
  if (!annealing.options.boundaries_stay) return {};
  std::vector<std::uint8_t> fixed = inner_vertices(annealing.field.topology);
  for (std::uint8_t& one : fixed) one = one == 0 ? 1 : 0;
  return fixed;
}

class VertexStage : public Stage {
 public:
  VertexStage(Annealing& annealing, std::uint32_t sweeps)
      : annealing_(annealing),
        options_(annealing.options),
        sweeps_(sweeps),
        schedule_(schedule_vertices(annealing.mesh, annealing.field.topology, EnergyTerms::neighborhood(options_))),
        step_(options_.step_size) {
    if (options_.conjugate_gradients) {
      descent_.emplace(annealing.field, annealing.terms, fixed_vertices(annealing));
    } else {
      process_.emplace(annealing.field, annealing.terms, schedule_, annealing.team.size());
    }
  }

  std::uint32_t sweeps() const override { return sweeps_; }
  std::uint64_t sites() const override { return schedule_.sites.size(); }

  bool sweep(std::uint32_t index, std::uint32_t number, SweepRecord& record) override {
    const double time = sweeps() > 1 ? static_cast<double>(index) / (sweeps() - 1) : 1.0;
    Weights weights = annealing_.terms.final_weights();
    weights.of<LikelihoodTerm>() = scheduled(options_.likelihood_weight_start, options_.likelihood_weight, time);
    record.stage = kVertexStage;
    record.likelihood_weight = weights.of<LikelihoodTerm>();
    annealing_.label_edges(weights, number, time, record);
    bool gains = true;
    if (descent_) {
      if (options_.edge_process) descent_->labels_changed();
      gains = descent_->step(weights, annealing_.team) || options_.edge_process;
    } else {
      propose(weights, number, time, record);
    }
    annealing_.positions_changed();
    annealing_.measure(record);
    return gains;
  }

  void exchange(StateArchive& archive) override {
    step_.exchange(archive);
    if (descent_) descent_->exchange(archive);
  }

 private:
  void propose(const Weights& weights, std::uint32_t number, double time, SweepRecord& record) {
    record.temperature = scheduled(options_.vertex_temperature_start, options_.vertex_temperature_end, time);
    record.step_size = step_.value();
    const CounterRandom random(options_.seed, RandomStream::kVertexProcess);
    record.acceptance =
        process_->sweep(weights, random, number, record.temperature, step_.value(), annealing_.team).acceptance();
    step_.adapt(record.acceptance);
  }

  Annealing& annealing_;
  const MrfOptions& options_;
  std::uint32_t sweeps_;
  Schedule schedule_;
  std::optional<VertexProcess> process_;  // one of the two, by the solver
  std::optional<Descent> descent_;
  StepSize step_;
};

}  // namespace

std::unique_ptr<Stage> make_vertex_stage(Annealing& annealing, std::uint32_t sweeps) {
  return std::make_unique<VertexStage>(annealing, sweeps);
}

}  // namespace crease
