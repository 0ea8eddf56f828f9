#include "core/smooth/annealing.h"
#include "core/smooth/step_size.h"
#include "core/smooth/vertex_descent.h"
#include "core/smooth/vertex_process.h"

namespace crease {
namespace {

Neighborhood neighborhood_of(const MrfOptions& options) {
  const bool wide =
      options.curvature_weight > 0 || options.ridge_line_weight > 0 || options.likelihood == LikelihoodKind::kVolume;
  return wide ? Neighborhood::kWide : Neighborhood::kFirstOrder;
}

class VertexStage : public Stage {
 public:
  VertexStage(Annealing& annealing, std::uint32_t sweeps)
      : annealing_(annealing),
        options_(annealing.options),
        sweeps_(sweeps),
        schedule_(schedule_vertices(annealing.mesh, annealing.field.topology, neighborhood_of(options_))),
        step_(options_.step_size) {
    if (options_.solver == Solver::kMeanField) {
      descent_.emplace(annealing.field);
    } else {
      process_.emplace(annealing.field, schedule_, annealing.team.size());
    }
  }

  std::uint32_t sweeps() const override { return sweeps_; }
  std::uint64_t sites() const override { return schedule_.sites.size(); }

  void sweep(std::uint32_t index, std::uint32_t number, SweepRecord& record) override {
    const double time = sweeps() > 1 ? static_cast<double>(index) / (sweeps() - 1) : 1.0;
    EnergyModel model = annealing_.final_model;
    model.likelihood_weight = scheduled(options_.likelihood_weight_start, options_.likelihood_weight, time);
    record.stage = kVertexStage;
    record.likelihood_weight = model.likelihood_weight;
    annealing_.label_edges(model, number, time, record);
    if (descent_) {
      descent_->run(model, annealing_.team);
    } else {
      propose(model, number, time, record);
    }
    annealing_.update_terms();
    annealing_.measure(record);
  }

  void exchange(StateArchive& archive) override {
    step_.exchange(archive);
    if (descent_) descent_->exchange(archive);
  }

 private:
  void propose(const EnergyModel& model, std::uint32_t number, double time, SweepRecord& record) {
    record.temperature = scheduled(options_.vertex_temperature_start, options_.vertex_temperature_end, time);
    record.step_size = step_.value();
    process_->set_model(model, annealing_.team);
    const CounterRandom random(options_.seed, RandomStream::kVertexProcess);
    record.acceptance =
        process_->sweep(random, number, record.temperature, step_.value(), annealing_.team).acceptance();
    step_.adapt(record.acceptance);
  }

  Annealing& annealing_;
  const MrfOptions& options_;
  std::uint32_t sweeps_;
  Schedule schedule_;
  std::optional<VertexProcess> process_;  // one of the two, by the solver
  std::optional<VertexDescent> descent_;
  StepSize step_;
};

}  // namespace

std::unique_ptr<Stage> make_vertex_stage(Annealing& annealing, std::uint32_t sweeps) {
  return std::make_unique<VertexStage>(annealing, sweeps);
}

}  // namespace crease
