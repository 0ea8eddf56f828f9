#include "core/smooth/run_state.h"

namespace crease {
namespace {

void exchange(StateArchive& archive, SweepRecord& record) {
  std::uint8_t trial = record.stage == kChoiceStage ? 1 : 0;
  archive.value(trial);
  record.stage = trial != 0 ? kChoiceStage : kVertexStage;
  archive.value(record.sweep);
  archive.value(record.energy);
  archive.value(record.likelihood_weight);
  archive.value(record.rms_displacement);
}

void exchange(StateArchive& archive, CandidateReport& candidate) {
  archive.text(candidate.family);
  archive.value(candidate.weight);
  archive.value(candidate.expected_error);
}

template <typename Item>
void exchange_all(StateArchive& archive, std::vector<Item>& items) {
  constexpr std::uint32_t kMost = 10'000;
  auto count = static_cast<std::uint32_t>(items.size());
  archive.value(count);
  if (count > kMost) throw CheckpointError("the checkpoint is not of this program");
  items.resize(count);
  for (Item& item : items) exchange(archive, item);
}

}  // namespace

void exchange(StateArchive& archive, std::vector<SweepRecord>& records) { exchange_all(archive, records); }

void exchange(StateArchive& archive, ChoiceReport& report) {
  archive.value(report.faces);
  archive.value(report.noise_sigma_first);
  archive.value(report.noise_sigma);
  archive.value(report.direction);
  if (static_cast<std::size_t>(report.direction) >= words_of(NoiseDirection{}).size()) {
    throw CheckpointError("the checkpoint is not of this program");
  }
  archive.value(report.impulsive);
  archive.value(report.moved_share);
  archive.value(report.varying);
  archive.value(report.noise_spread);
  archive.value(report.correlation_length);
  archive.value(report.spikes);
  archive.text(report.family);
  archive.value(report.weight);
  archive.value(report.margin);
  exchange_all(archive, report.candidates);
}

}  // namespace crease
