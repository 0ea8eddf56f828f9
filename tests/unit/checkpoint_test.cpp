#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <set>

#include "core/base/state_archive.h"
#include "core/measure/noise.h"
#include "core/smooth/smooth.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

constexpr std::uint32_t kSweeps = 24;

MrfOptions options_of(Process process) {
  MrfOptions options;
  options.process = process;
  options.solver = Solver::kMetropolis;
  options.sweeps = kSweeps;
  options.rounds = 3;
  return options;
}

struct Variant {
  std::string name;
  MrfOptions options;
};

std::vector<Variant> variants() {
  std::vector<Variant> all;
  for (const auto& [process, process_name] :
       {std::pair{Process::kVertex, "vertex"}, {Process::kFace, "face"}, {Process::kBoth, "both"}}) {
    all.push_back({process_name, options_of(process)});
  }
  MrfOptions rich = options_of(Process::kBoth);
  rich.likelihood = LikelihoodKind::kAnisotropic;
  rich.curvature_weight = 0.3;
  rich.continuity_weight = 0.2;
  rich.ridge_line_weight = 0.2;
  rich.corner_weight = 0.3;
  all.push_back({"every term", rich});
  MrfOptions volume = options_of(Process::kVertex);
  volume.likelihood = LikelihoodKind::kVolume;
  all.push_back({"volume", volume});
  MrfOptions unlabelled = options_of(Process::kBoth);
  unlabelled.edge_process = false;
  all.push_back({"no edge process", unlabelled});
  MrfOptions downhill = unlabelled;
  downhill.process = Process::kVertex;
  downhill.conjugate_gradients = true;
  all.push_back({"conjugate gradients", downhill});
  all.push_back({"automatic", {}});
  MrfOptions correlated;
  correlated.noise = NoiseOption::kCorrelated;
  all.push_back({"correlated noise", correlated});
  MrfOptions organic;  // each stage begins with what the one before has made
  organic.surface = SurfaceOption::kOrganic;
  all.push_back({"organic", organic});
  MrfOptions along_normals;  // each stage begins with the last step of the one before
  along_normals.noise = NoiseOption::kNormal;
  all.push_back({"noise along normals", along_normals});
  return all;
}

const Mesh& noisy_cube() {
  static const Mesh mesh = add_noise(test::cube(5), 0.1, 1, NoiseKind::kGaussian);
  return mesh;
}

SmoothResult run(const Mesh& mesh, const MrfOptions& options, RunContext& context, std::uint32_t threads = 1) {
  return smooth(mesh, build_topology(mesh), {options, threads}, context);
}

/// Runs up to sweep `last` from `checkpoint`, and replaces it by the checkpoint at the end.
SmoothResult run_until(std::uint32_t last, const MrfOptions& options, std::string& checkpoint,
                       const Mesh& mesh = noisy_cube()) {
  const std::string from = checkpoint;
  RunContext context;
  context.checkpoint = from;
  context.on_sweep = [&](const SweepView& view) {
    checkpoint = view.checkpoint();
    return view.record.sweep < last;
  };
  return run(mesh, options, context);
}

bool same_record(const SweepRecord& a, const SweepRecord& b) {
  return a.sweep == b.sweep && a.stage == b.stage && a.energy.total() == b.energy.total() &&
         a.likelihood_weight == b.likelihood_weight && a.temperature == b.temperature &&
         a.label_temperature == b.label_temperature && a.step_size == b.step_size && a.acceptance == b.acceptance &&
         a.label_acceptance == b.label_acceptance && a.ridge_edges == b.ridge_edges &&
         a.rms_displacement == b.rms_displacement;
}

void expect_same(const SmoothResult& a, const SmoothResult& b) {
  EXPECT_EQ(a.positions, b.positions);
  EXPECT_EQ(a.labels, b.labels);
  EXPECT_EQ(a.site_proposals, b.site_proposals);
  EXPECT_EQ(a.label_proposals, b.label_proposals);
  EXPECT_TRUE(std::ranges::equal(a.sweeps, b.sweeps, same_record));
}

TEST(Checkpoint, ARunResumedAtAnySweepEndsWithTheSameBits) {
  for (const auto& [name, options] : variants()) {
    SCOPED_TRACE(name);
    RunContext undisturbed;
    const SmoothResult expected = run(noisy_cube(), options, undisturbed);
    const auto last = std::min(kSweeps, static_cast<std::uint32_t>(expected.sweeps.size()));
    for (std::uint32_t sweep = 1; sweep <= last; ++sweep) {
      SCOPED_TRACE(sweep);
      std::string checkpoint;
      const SmoothResult first = run_until(sweep, options, checkpoint);
      ASSERT_TRUE(first.cancelled);
      RunContext again;
      again.checkpoint = checkpoint;
      const SmoothResult resumed = run(noisy_cube(), options, again, 3);
      EXPECT_FALSE(resumed.cancelled);
      EXPECT_GE(resumed.seconds, first.seconds / 2) << "time before the checkpoint counts, too";
      expect_same(resumed, expected);
    }
  }
}

TEST(Checkpoint, ARunEndsAfterItsLastSolveWhenItIsToldTo) {
  for (const auto& [name, options] : variants()) {
    if (options.solver == Solver::kMetropolis) continue;
    SCOPED_TRACE(name);
    RunContext undisturbed;
    const SmoothResult expected = run(noisy_cube(), options, undisturbed);
    std::uint32_t asked = 0;
    std::string checkpoint;
    RunContext context;
    context.on_sweep = [&](const SweepView& view) {
      if (view.record.sweep < expected.sweeps.size() || ++asked < 3)
        return true;  // of the last solve, then of what follows
      checkpoint = view.checkpoint();
      return false;
    };
    EXPECT_TRUE(run(noisy_cube(), options, context).cancelled);
    ASSERT_EQ(asked, 3U);
    RunContext again;
    again.checkpoint = checkpoint;
    expect_same(run(noisy_cube(), options, again, 3), expected);
  }
}

TEST(Checkpoint, ARunMayBeInterruptedManyTimes) {
  for (const auto& [name, options] : variants()) {
    SCOPED_TRACE(name);
    RunContext undisturbed;
    const SmoothResult expected = run(noisy_cube(), options, undisturbed);
    std::string checkpoint;
    const auto sweeps = static_cast<std::uint32_t>(expected.sweeps.size());
    for (std::uint32_t sweep = 3; sweep < sweeps; sweep += 3) run_until(sweep, options, checkpoint);
    const SmoothResult last = run_until(sweeps + 1, options, checkpoint);
    expect_same(last, expected);
  }
}

TEST(Checkpoint, CompletedSweepsAreNotRepeated) {
  std::string checkpoint;
  run_until(10, options_of(Process::kBoth), checkpoint);
  RunContext again;
  again.checkpoint = checkpoint;
  std::vector<std::uint32_t> sweeps;
  again.on_sweep = [&](const SweepView& view) {
    sweeps.push_back(view.record.sweep);
    return true;
  };
  run(noisy_cube(), options_of(Process::kBoth), again);
  ASSERT_EQ(sweeps.size(), kSweeps - 10);
  EXPECT_EQ(sweeps.front(), 11U);
}

TEST(Checkpoint, ACheckpointOfAnotherRunIsRefused) {
  const MrfOptions options = options_of(Process::kBoth);
  std::string checkpoint;
  run_until(20, options, checkpoint);
  const auto refused = [&](const Mesh& mesh, const MrfOptions& of_run, const std::string& bytes) {
    RunContext context;
    context.checkpoint = bytes;
    EXPECT_THROW(run(mesh, of_run, context), CheckpointError);
  };
  refused(test::cube(4), options, checkpoint);
  refused(test::icosphere(2), options, checkpoint);
  refused(noisy_cube(), options_of(Process::kFace), checkpoint);
  MrfOptions fewer = options;
  fewer.sweeps = 10;
  refused(noisy_cube(), fewer, checkpoint);
  refused(noisy_cube(), options, checkpoint + "x");
}

TEST(Checkpoint, ADamagedCheckpointIsRefusedOrCompletesARun) {
  const MrfOptions options = options_of(Process::kBoth);
  std::string checkpoint;
  run_until(kSweeps - 1, options, checkpoint);
  for (std::size_t length = 1; length < checkpoint.size(); length += 1 + checkpoint.size() / 97) {
    RunContext context;
    const std::string torn = checkpoint.substr(0, length);
    context.checkpoint = torn;
    EXPECT_THROW(run(noisy_cube(), options, context), CheckpointError) << length;
  }
  std::mt19937 random(1);
  for (int i = 0; i < 50; ++i) {
    std::string damaged = checkpoint;
    damaged[random() % 64] = static_cast<char>(random());
    RunContext context;
    context.checkpoint = damaged;
    try {
      EXPECT_LE(run(noisy_cube(), options, context).sweeps.size(), kSweeps);
    } catch (const CheckpointError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr("checkpoint"));
    }
  }
}

}  // namespace
}  // namespace crease
