#include "server/api/result_files.h"

#include <csignal>
#include <future>

#include "proto/assembly.h"
#include "proto/convert.h"
#include "proto/parameter_table.h"
#include "proto/result_formats.h"
#include "tests/support/store_fixture.h"

namespace creased::test {
namespace {

using crease::MeshFormat;

const crease::Format& kGlb = crease::format_row(MeshFormat::kGlb);
const crease::Format& kObj = crease::format_row(MeshFormat::kObj);
const crease::Format& kJsonFormat = crease::format_row(MeshFormat::kJson);

const std::string kJob = "00000000000000000def";

class ResultFilesTest : public StoreTest {
 protected:
  void SetUp() override {
    upload_ = crease::test::obj_text(crease::test::cube(3));
    input_ = crease::check_upload({.bytes = upload_, .format = "obj", .name = "cube.obj"});
    crease::v1::InputFacts facts = crease::to_message(input_);
    crease::describe_upload(facts, "cube.obj", upload_.size(), crease::sha256_hex(upload_));
    crease::v1::Parameters parameters;
    parameters.set_sweeps(2);
    job_ = crease::settled(facts, parameters, {});
    crease::RunContext context;
    output_ = crease::run_job(input_, crease::to_options(job_.parameters()), context);
    *job_.mutable_result() = crease::to_message(output_.facts);
    keep_job();
  }

  void keep_job() {
    auto job = new_job(store(), kJob, upload_, job_.parameters());
    bool created = false;
    store().submit(job, created);
    job_.set_id(kJob);
    const Claim claim = store().claim("test", kLong).value();
    auto message = crease::to_message(output_.result);
    for (const auto& position : input_.mesh.positions) {
      for (const double coordinate : position) message.add_measured(coordinate);
    }
    write(file::kResult, message.SerializeAsString());
    write(file::kReport, crease::make_report(job_, output_, {}).SerializeAsString());
    ASSERT_TRUE(store().succeed(claim, job_.result(), {}, records_));
  }

  void write(std::string_view name, const std::string& bytes) {
    std::ofstream(file_path(kJob, name), std::ios::binary) << bytes;
    records_.push_back({std::string(name), bytes.size(), crease::sha256_hex(bytes)});
  }

  std::string bytes_of(const ResultFile& wanted) {
    const auto file = files_.file(job_, wanted, {});
    return read_whole(file->descriptor.get(), "a file");
  }
  void signal_processes(int number) const {
    for (const int process : pool_.process_ids()) ::kill(process, number);
  }

  std::string upload_;
  crease::CheckedInput input_;
  crease::JobOutput output_;
  v1::Job job_;
  std::vector<FileRecord> records_;
  TaskPool pool_{{.executable = CREASED_BIN, .processes = 1}};
  Encoder encoder_{pool_, {}};
  ResultFiles files_{store(), encoder_};
};

TEST_F(ResultFilesTest, EveryPartHasTheBytesOfALocalRun) {
  for (const auto* format : crease::mesh_formats()) {
    EXPECT_EQ(bytes_of({v1::RESULT_PART_MESH, *format}),
              crease::encode(v1::RESULT_PART_MESH, *format, output_.result, job_))
        << format->name;
  }
  for (const auto* format : crease::label_formats()) {
    for (const double min : {0.0, 0.5}) {
      EXPECT_EQ(bytes_of({v1::RESULT_PART_LABELS, *format, min}),
                crease::encode(v1::RESULT_PART_LABELS, *format, output_.result, job_, min))
          << format->name;
    }
  }
  for (const auto* format : crease::ridge_formats()) {
    EXPECT_EQ(bytes_of({v1::RESULT_PART_RIDGES, *format}),
              crease::encode(v1::RESULT_PART_RIDGES, *format, output_.result, job_))
        << format->name;
  }
  auto measured = output_.result;
  measured.mesh.positions = input_.mesh.positions;
  EXPECT_EQ(bytes_of({v1::RESULT_PART_MEASURED, kGlb}), crease::encode(v1::RESULT_PART_MESH, kGlb, measured, job_));
  for (const auto* format : crease::report_formats()) {
    EXPECT_EQ(bytes_of({v1::RESULT_PART_REPORT, *format}),
              crease::encode(*format, crease::make_report(job_, output_, {})));
  }
}

TEST_F(ResultFilesTest, OfAFileThatIsKeptTheSecondReaderGetsTheSame) {
  const ResultFile glb{v1::RESULT_PART_MESH, kGlb};
  const std::string first = bytes_of(glb);
  EXPECT_EQ(read_file(job_folder(kJob) / "mesh.glb"), first);
  EXPECT_EQ(store().file_record(kJob, "mesh.glb")->bytes, first.size());
  pool_.await_start();
  signal_processes(SIGSTOP);
  EXPECT_EQ(bytes_of(glb), first) << "no process is needed any more";
  signal_processes(SIGCONT);
  EXPECT_TRUE(fs::is_empty(incoming()));
}

TEST_F(ResultFilesTest, TwoWhoAskForTheSameShareItsEncoding) {
  pool_.await_start();
  signal_processes(SIGSTOP);
  const auto ask = [&] { return files_.file(job_, {v1::RESULT_PART_MEASURED, kGlb}, {}); };
  auto one = std::async(std::launch::async, ask), other = std::async(std::launch::async, ask);
  ASSERT_TRUE(eventually([&] { return files_.askers(kJob, "measured.glb") == 2; }));
  signal_processes(SIGCONT);
  EXPECT_EQ(one.get(), other.get());
}

TEST_F(ResultFilesTest, AnEncodingStopsWhenAllHaveLeftAndNotBefore) {
  pool_.await_start();
  const auto before = pool_.process_ids();
  signal_processes(SIGSTOP);
  std::atomic<bool> one_left{false}, other_left{false};
  const auto ask = [&](const std::atomic<bool>& left) {
    return error_code([&] { files_.file(job_, {v1::RESULT_PART_MESH, kObj}, {"", [&] { return left.load(); }}); });
  };
  auto one = std::async(std::launch::async, ask, std::cref(one_left));
  ASSERT_TRUE(eventually([&] { return files_.askers(kJob, "mesh.obj") == 1; }));
  auto other = std::async(std::launch::async, ask, std::cref(other_left));
  ASSERT_TRUE(eventually([&] { return files_.askers(kJob, "mesh.obj") == 2; }));
  one_left = true;
  ASSERT_TRUE(eventually([&] { return files_.askers(kJob, "mesh.obj") == 1; }));
  EXPECT_EQ(pool_.process_ids(), before);
  other_left = true;
  EXPECT_EQ(one.get(), code::kRequestTimeout);
  EXPECT_EQ(other.get(), code::kRequestTimeout);
  EXPECT_TRUE(eventually([&] { return pool_.process_ids().size() == 1 && pool_.process_ids() != before; }));
  EXPECT_FALSE(bytes_of({v1::RESULT_PART_MESH, kObj}).empty());
}

TEST_F(ResultFilesTest, AResultOfAnotherSizeOrContentIsDamaged) {
  std::ofstream(file_path(kJob, file::kResult), std::ios::app) << "x";
  EXPECT_EQ(error_code([&] { bytes_of({v1::RESULT_PART_MESH, kGlb}); }), code::kResultDamaged);
  EXPECT_FALSE(bytes_of({v1::RESULT_PART_REPORT, kJsonFormat}).empty());
}

TEST_F(ResultFilesTest, AProcessThatIsKilledIsAnErrorOfThisFileAlone) {
  pool_.await_start();
  signal_processes(SIGSTOP);
  auto lost = std::async(std::launch::async, [&] {
    return error_code([&] { bytes_of({v1::RESULT_PART_MESH, kGlb}); });
  });
  ASSERT_TRUE(eventually([&] { return files_.askers(kJob, "mesh.glb") == 1; }));
  signal_processes(SIGKILL);
  EXPECT_THAT(lost.get(), testing::AnyOf(std::nullopt, code::kEncodingFailed, code::kProcessUnavailable));
  EXPECT_FALSE(bytes_of({v1::RESULT_PART_MESH, kGlb}).empty());
}

}  // namespace
}  // namespace creased::test
