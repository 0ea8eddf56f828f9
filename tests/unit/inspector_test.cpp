#include "server/worker/inspector.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <poll.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <future>
#include <mutex>
#include <thread>

#include "core/base/sanitized.h"
#include "core/job.h"
#include "proto/convert.h"
#include "server/base/durable_file.h"
#include "server/base/failure.h"
#include "tests/support/meshes.h"
#include "tests/support/server_process.h"
#include "tests/support/store_support.h"

namespace creased {
namespace code = crease::code;
namespace {

namespace fs = std::filesystem;
using crease::test::eventually;
using crease::test::obj_text;
using testing::HasSubstr;

struct PoolOptions : Inspector::Options {
  fs::path executable = CREASED_BIN;
  std::size_t processes = 2;
};

/// An inspector with processes of its own.
class PooledInspector {
 public:
  explicit PooledInspector(const PoolOptions& options)
      : pool_({.executable = options.executable, .processes = options.processes}), inspector_(pool_, options) {}

  Inspection inspect(const fs::path& mesh, const std::string& format, const std::string& name,
                     const fs::path& weights = {}) {
    return inspector_.inspect({mesh, format, name, weights});
  }
  Inspection inspect(const fs::path& mesh, const std::string& owner) {
    return inspector_.inspect({mesh, "obj", "mesh.obj", {}, owner});
  }
  std::vector<int> process_ids() const { return pool_.process_ids(); }
  std::size_t waiting() const { return pool_.waiting(); }

 private:
  TaskPool pool_;
  Inspector inspector_;
};

class InspectorTest : public testing::Test {
 protected:
  fs::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_.path() / name, std::ios::binary) << bytes;
    return folder_.path() / name;
  }
  /// Takes seconds to check.
  fs::path slow_upload() const {
    static const std::string text = obj_text(crease::test::grid(800, 800));
    return write("slow.obj", text);
  }
  static PoolOptions options() { return {}; }

  const crease::test::TemporaryFolder folder_;
};

std::optional<crease::Error> refusal(PooledInspector& inspector, const fs::path& upload,
                                     const std::string& format = {}) {
  try {
    inspector.inspect(upload, format, upload.filename());
  } catch (const crease::Error& error) {
    return error;
  }
  return std::nullopt;
}

std::size_t faces_found(PooledInspector& inspector, const fs::path& upload) {
  try {
    return inspector.inspect(upload, "obj", "mesh.obj").facts.faces();
  } catch (const crease::Error&) {
    return 0;
  }
}

TEST_F(InspectorTest, ReturnsTheFactsAndWarningsOfCore) {
  PooledInspector inspector(options());
  for (const auto& [name, mesh, manifold, closed, degenerate] : crease::test::mesh_family()) {
    const std::string text = obj_text(mesh);
    const auto expected = crease::check_input(text, crease::MeshFormat::kObj);
    const Inspection found = inspector.inspect(write("mesh.obj", text), "", "mesh.obj");
    crease::v1::InputFacts facts = crease::to_message(expected.facts);
    facts.set_format("obj");
    EXPECT_EQ(found.facts.SerializeAsString(), facts.SerializeAsString()) << name;
    EXPECT_EQ(found.warnings.size(), expected.warnings.size()) << name;
  }
}

TEST_F(InspectorTest, ARefusalNamesTheFaultAndItsPlace) {
  PooledInspector inspector(options());
  const auto error = refusal(inspector, write("bad.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n")).value();
  EXPECT_EQ(error.code(), code::kMeshIndexOutOfRange);
  EXPECT_EQ(error.place(), "face 0");
  EXPECT_FALSE(error.detail().empty());
  EXPECT_EQ(refusal(inspector, write("mesh.obj", "v 0 0 0\n"), "step").value().code(), code::kMeshFormatUnknown);
}

TEST_F(InspectorTest, ARefusalOfWeightsNamesTheItem) {
  PooledInspector inspector(options());
  const fs::path upload = write("triangle.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_EQ(inspector.inspect(upload, "", "a.obj", write("good.json", "[1, 2, 3]")).facts.weights_sha256().size(), 64U);
  try {
    inspector.inspect(upload, "", "a.obj", write("bad.json", "[1, 2, -3]"));
    FAIL();
  } catch (const crease::Error& error) {
    EXPECT_EQ(error.code(), code::kWeightsInvalid);
    EXPECT_EQ(error.field(), "weights[2]");
    EXPECT_EQ(error.value(), "-3");
    EXPECT_EQ(error.expected(), "a number from 0 to 1000000");
  }
}

TEST_F(InspectorTest, TheFormatComesFromTheRequestThenTheNameThenTheBytes) {
  PooledInspector inspector(options());
  const fs::path upload = write("mesh", obj_text(crease::test::cube(2)));
  EXPECT_EQ(inspector.inspect(upload, "obj", "mesh.ply").facts.format(), "obj");
  EXPECT_EQ(inspector.inspect(upload, "", "mesh.obj").facts.format(), "obj");
  EXPECT_EQ(inspector.inspect(upload, "", "").facts.format(), "obj");
  EXPECT_TRUE(refusal(inspector, upload, "ply"));
}

TEST_F(InspectorTest, TheLimitsReachTheChildren) {
  auto bounded = options();
  bounded.max_faces = 11;
  PooledInspector inspector(bounded);
  EXPECT_EQ(refusal(inspector, write("cube.obj", obj_text(crease::test::cube(1)))).value().code(), code::kMeshTooLarge);
}

TEST_F(InspectorTest, MoreCallersThanChildrenAreAllServed) {
  constexpr int kCallers = 12, kCalls = 5;
  PooledInspector inspector(options());
  std::atomic<int> right{0};
  {
    std::vector<std::jthread> callers;
    for (int i = 0; i < kCallers; ++i) {
      const crease::Mesh mesh = crease::test::grid(i + 2, 3);
      const fs::path upload = write("grid" + std::to_string(i) + ".obj", obj_text(mesh));
      callers.emplace_back([&inspector, &right, upload, faces = mesh.triangles.size()] {
        for (int call = 0; call < kCalls; ++call) right += faces_found(inspector, upload) == faces ? 1 : 0;
      });
    }
  }
  EXPECT_EQ(right, kCallers * kCalls);
}

TEST_F(InspectorTest, KeysTakeTurns) {
  auto single = options();
  single.processes = 1;
  PooledInspector inspector(single);
  const fs::path upload = write("cube.obj", obj_text(crease::test::cube(1)));
  ASSERT_TRUE(eventually([&] { return inspector.process_ids().size() == 1; }));
  const int process = inspector.process_ids().at(0);
  ::kill(process, SIGSTOP);
  std::mutex mutex;
  std::vector<std::string> order;
  {
    std::vector<std::jthread> callers;
    std::size_t waiting = 0;
    for (const std::string owner : {"anna", "anna", "anna", "bert"}) {
      callers.emplace_back([&, owner] {
        inspector.inspect(upload, owner);
        const std::lock_guard lock(mutex);
        order.push_back(owner);
      });
      // The first has the process, the others wait.
      ASSERT_TRUE(eventually([&] { return inspector.waiting() == waiting; }));
      ++waiting;
    }
    ::kill(process, SIGCONT);
  }
  EXPECT_EQ(order.size(), 4U);
  EXPECT_NE(order.back(), "bert");
}

TEST_F(InspectorTest, ChildrenKilledWhileIdleAreReplacedSilently) {
  PooledInspector inspector(options());
  const fs::path upload = write("cube.obj", obj_text(crease::test::cube(1)));
  ASSERT_TRUE(eventually([&] { return inspector.process_ids().size() == 2; }));
  const auto killed = inspector.process_ids();
  for (const int process : killed) {
    const Descriptor end(static_cast<int>(::syscall(SYS_pidfd_open, process, 0)));
    ::kill(process, SIGKILL);
    pollfd ended{.fd = end.get(), .events = POLLIN, .revents = 0};
    ASSERT_EQ(::poll(&ended, 1, -1), 1);
  }
  EXPECT_EQ(inspector.inspect(upload, "", "cube.obj").facts.faces(), 12U);
  EXPECT_NE(inspector.process_ids(), killed);
}

TEST_F(InspectorTest, AnUploadThatKillsItsChildFailsAloneAndTheNextIsServed) {
  auto single = options();
  single.processes = 1;
  PooledInspector inspector(single);
  const fs::path slow = slow_upload(), upload = write("cube.obj", obj_text(crease::test::cube(1)));
  auto failed = std::async(std::launch::async, [&] { return refusal(inspector, slow); });
  // A child that has a child of its own is busy with the upload.
  EXPECT_TRUE(eventually([&] {
    for (const int process : inspector.process_ids()) {
      if (!crease::test::children_of(process).empty()) ::kill(process, SIGKILL);
    }
    return failed.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  }));
  const auto error = failed.get().value();
  EXPECT_EQ(error.code(), code::kInspectionFailed);
  EXPECT_THAT(error.detail(), HasSubstr("signal 9"));
  EXPECT_TRUE(eventually([&] { return faces_found(inspector, upload) == 12; }));
}

TEST_F(InspectorTest, AnUploadThatTakesTooLongIsRefusedAndTheNextIsServed) {
  auto hasty = options();
  hasty.processes = 1;
  hasty.timeout = std::chrono::milliseconds(1'000);
  PooledInspector inspector(hasty);
  const fs::path upload = write("cube.obj", obj_text(crease::test::cube(1)));
  ASSERT_TRUE(eventually([&] { return inspector.process_ids().size() == 1; }));
  ::kill(inspector.process_ids().at(0), SIGSTOP);  // so that it takes for ever
  const auto error = refusal(inspector, upload).value();
  EXPECT_EQ(error.code(), code::kInspectionFailed);
  EXPECT_THAT(error.detail(), HasSubstr("longer than 1000 ms"));
  EXPECT_TRUE(eventually([&] { return !refusal(inspector, upload); }));
}

TEST_F(InspectorTest, AnUploadThatNeedsTooMuchMemoryFailsAndTheNextIsServed) {
  if (crease::kSanitized) GTEST_SKIP() << "sanitizers reserve more address space than any limit";
  auto small = options();
  small.processes = 1;
  small.memory_limit_mb = 512;
  PooledInspector inspector(small);
  const fs::path huge = write("huge.obj", "v 0 0 0\n");
  fs::resize_file(huge, std::uintmax_t{1} << 32U);  // sparse
  const auto error = refusal(inspector, huge).value();
  EXPECT_EQ(error.code(), code::kInspectionFailed);
  EXPECT_THAT(error.detail(), HasSubstr("512 MiB of memory"));
  EXPECT_EQ(inspector.inspect(write("cube.obj", obj_text(crease::test::cube(1))), "", "").facts.faces(), 12U);
}

TEST_F(InspectorTest, AProgramThatCannotStartIsAnErrorForTheCaller) {
  auto broken = options();
  broken.executable = "/no/such/program";
  PooledInspector inspector(broken);
  const auto error = refusal(inspector, write("cube.obj", "v 0 0 0\n")).value();
  EXPECT_EQ(error.code(), code::kProcessUnavailable);
  EXPECT_THAT(error.detail(), HasSubstr("No such file"));
}

}  // namespace
}  // namespace creased
