#include "tests/support/failing_calls.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/mman.h>

#include <cstdlib>
#include <map>

#include "core/base/sanitized.h"
#include "server/base/durable_file.h"
#include "tests/service/service_fixture.h"
#include "tests/support/store_audit.h"

namespace crease::test {
namespace {

using creased::Descriptor;
using testing::IsEmpty;

const std::string kQuery = "sweeps=3&threads=1&solver=metropolis";
constexpr std::array kKinds = {"EIO", "ENOSPC", "short", "EINTR"};
static_assert(kKinds.size() == kFailKinds);

/// How many runs to make; the long form has more.
std::size_t runs_to_make() {
  const char* const given = std::getenv("CREASED_FAILING_RUNS");
  return given == nullptr ? 40 : std::strtoul(given, nullptr, 10);
}

/// What a test shares with the processes whose calls fail.
class SharedCalls {
 public:
  explicit SharedCalls(const std::filesystem::path& path) {
    const Descriptor file(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600));
    if (::ftruncate(file.get(), sizeof(FailingCalls)) != 0) throw std::runtime_error("cannot make the shared file");
    calls_ = static_cast<FailingCalls*>(
        ::mmap(nullptr, sizeof(FailingCalls), PROT_READ | PROT_WRITE, MAP_SHARED, file.get(), 0));
  }
  ~SharedCalls() { ::munmap(calls_, sizeof(FailingCalls)); }
  SharedCalls(const SharedCalls&) = delete;
  SharedCalls& operator=(const SharedCalls&) = delete;

  std::uint64_t count() const { return __atomic_load_n(&calls_->count, __ATOMIC_SEQ_CST); }
  /// Makes the n-th call from now on fail.
  void arm(std::uint64_t n, std::uint32_t kind) {
    calls_->fired = 0;
    calls_->kind = kind;
    __atomic_store_n(&calls_->fire_at, count() + n, __ATOMIC_SEQ_CST);
  }
  void disarm() { __atomic_store_n(&calls_->fire_at, 0, __ATOMIC_SEQ_CST); }
  bool fired() const { return __atomic_load_n(&calls_->fired, __ATOMIC_SEQ_CST) != 0; }
  std::string what() const { return calls_->what; }

 private:
  FailingCalls* calls_ = nullptr;
};

/// What the bytes of a result must be.
using Parts = std::map<std::string, std::string>;
const std::vector<std::string> kParts = {"/mesh.ply", "/labels.csv", "/ridges.json"};

class FailingDisk : public ::testing::Test {
 protected:
  void SetUp() override {
    if (kSanitized) GTEST_SKIP() << "a sanitizer has to be loaded before everything else";
    start();
  }
  void TearDown() override {
    for (const char* name : {"LD_PRELOAD", "CREASED_FAILING_CALLS", "CREASED_FAILING_FOLDER"}) ::unsetenv(name);
  }

  void start() {
    server_.reset();
    ::setenv("CREASED_FAILING_CALLS", calls_path_.c_str(), 1);
    ::setenv("CREASED_FAILING_FOLDER", data_dir_.c_str(), 1);
    ::setenv("LD_PRELOAD", FAILING_CALLS_LIBRARY, 1);
    server_ = std::make_unique<ServerProcess>(std::vector<std::string>{
        "--data-dir", data_dir_.string(), "--workers", "1", "--max-connections", "32", "--max-streams", "8"});
    ::unsetenv("LD_PRELOAD");
  }

  /// Asks until the answer is one of these; an error of the store may come before it.
  RawResponse ask(const std::string& method, const std::string& target, const std::vector<int>& wanted,
                  const std::string& body = {}) {
    RawResponse answer;
    const bool came = eventually([&] {
      if (!is_alive(server_->pid())) {
        ++restarts_;
        start();
      }
      answer = exchange(server_->port(), method, target, {}, body);
      if (is_cut_short(answer)) {  // and the client can see it
        ++refusals_["cut short"];
        return false;
      }
      if (std::ranges::count(wanted, answer.status) > 0) return true;
      ++refusals_[answer.code()];
      if (answer.status != 503 && answer.status != 507 && answer.status != 500) wrong(method + " " + target, answer);
      return false;
    });
    if (!came) wrong(method + " " + target + " is never answered", answer);
    return answer;
  }

  static bool is_cut_short(const RawResponse& answer) {
    const std::string length = answer.header("content-length");
    return !length.empty() && std::stoul(length) != answer.body.size();
  }

  void wrong(const std::string& what, const RawResponse& answer) {
    faults_.push_back(fmt::format("{}: {} {}", what, answer.status, answer.body.substr(0, 300)));
  }

  /// A mesh on its way through the service; returns what was downloaded.
  Parts run() {
    const auto job = nlohmann::json::parse(ask("POST", "/v1/jobs?" + kQuery, {200, 202}, obj_text(cube(4))).body);
    const std::string path = "/v1/jobs/" + job["id"].get<std::string>();
    nlohmann::json last;
    eventually([&] {
      last = nlohmann::json::parse(ask("GET", path, {200}).body);
      return last["state"] != "queued" && last["state"] != "running";
    });
    if (last["state"] != "succeeded") faults_.push_back("an accepted job is lost: " + last.dump());
    Parts parts;
    for (const std::string& part : kParts) parts[part] = ask("GET", path + part, {200}).body;
    ask("GET", path + "/report", {200});
    ask("DELETE", path, {204, 404});
    ask("GET", path, {404});
    return parts;
  }

  TemporaryFolder folder_;
  const std::filesystem::path data_dir_ = folder_.path() / "data", calls_path_ = folder_.path() / "calls";
  SharedCalls calls_{calls_path_};
  std::unique_ptr<ServerProcess> server_;
  std::vector<std::string> faults_;
  std::map<std::string, std::size_t> refusals_;
  std::size_t restarts_ = 0;
};

// Whatever call fails, once: what was accepted is done, what is served is right, what is deleted is gone.
TEST_F(FailingDisk, NoFailedCallLosesAJobOrServesWrongBytes) {
  const Parts expected = run();
  ASSERT_THAT(faults_, IsEmpty());
  const std::uint64_t before = calls_.count();
  run();
  const std::uint64_t calls = calls_.count() - before;
  const std::size_t runs = runs_to_make();
  std::map<std::string, std::size_t> fired;
  for (std::size_t i = 0; i < runs; ++i) {
    const auto kind = static_cast<std::uint32_t>(i % kKinds.size());
    const std::uint64_t n = 1 + i * calls / runs;
    calls_.arm(n, kind);
    const Parts parts = run();
    const std::string where = fmt::format("run {}: {} at call {} of {} ({})", i, kKinds.at(kind), n, calls,
                                          calls_.fired() ? calls_.what() : "did not come");
    if (calls_.fired()) ++fired[kKinds.at(kind)];
    calls_.disarm();
    EXPECT_TRUE(parts == expected) << where;
    EXPECT_THAT(faults_, IsEmpty()) << where;
    EXPECT_THAT(faults_of_store(data_dir_, {}), IsEmpty()) << where;
    faults_.clear();
  }
  std::size_t all = 0;
  for (const auto& [kind, count] : fired) all += count;
  EXPECT_GT(all, runs / 2) << "of " << calls << " calls of a run";
  fmt::print("{} runs of about {} calls each, {} with a failed call", runs, calls, all);
  for (const auto& [kind, count] : fired) fmt::print(", {} {}", count, kind);
  fmt::print("; {} restarts; refused and tried again:", restarts_);
  for (const auto& [code, count] : refusals_) fmt::print(" {} {}", count, code.empty() ? "connection" : code);
  fmt::print("\n");
}

}  // namespace
}  // namespace crease::test
