#include "server/worker/sandbox.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstring>
#include <utility>
#include <vector>

#include "core/base/sanitized.h"
#include "server/worker/channel.h"

namespace creased {
namespace code = crease::code;
namespace v1 = crease::v1;
namespace {

constexpr std::chrono::milliseconds kEndGrace{5'000};
constexpr std::size_t kMostErrorBytes = 2'000;  // of one task, in the log

/// A pipe that never waits: what does not fit is lost.
std::pair<Descriptor, Descriptor> make_pipe() {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC | O_NONBLOCK) != 0) {
    throw crease::Error(code::kProcessUnavailable, "cannot make a pipe: " + errno_text(errno));
  }
  return {Descriptor(ends[0]), Descriptor(ends[1])};
}

Loss loss_of(const v1::ComputeExit& exit, const v1::ComputeLimits& limits) {
  if (exit.signal() == SIGXCPU) {
    return {.what = fmt::format("needed more than {} s of processor time", limits.cpu_seconds()),
            .code = code::kTimeLimitExceeded,
            .by_limit = true};
  }
  if (exit.signal() == 0) return {.what = fmt::format("ended with code {}", exit.code())};
  const char* name = ::sigabbrev_np(exit.signal());
  return {.what = fmt::format("was killed by signal {} (SIG{})", exit.signal(), name == nullptr ? "?" : name)};
}

}  // namespace

Sandbox::Sandbox(const std::filesystem::path& executable) : Sandbox(executable, make_channel(), make_pipe()) {}

Sandbox::Sandbox(const std::filesystem::path& executable, Ends channel, Ends errors)
    : process_({.executable = executable,
                .arguments = {"compute"},
                .standard_streams = channel.second.get(),
                // A sanitizer has its options in the environment and a lot to say.
                .standard_error = crease::kSanitized ? -1 : errors.second.get(),
                .with_environment = crease::kSanitized}),
      requests_(std::move(channel.first)),
      errors_(std::move(errors.first)) {}

Sandbox::~Sandbox() { log_errors(); }

void Sandbox::start(const v1::ComputeTask& task, std::span<const int> files) {
  auto [ours, theirs] = make_channel();
  std::vector<int> all{theirs.get()};
  all.insert(all.end(), files.begin(), files.end());
  if (!send_message(requests_.get(), task, all)) {
    log_errors();
    throw crease::Error(code::kProcessUnavailable, "the computing process " + process_.wait());
  }
  channel_ = std::move(ours);
  limits_ = task.limits();
}

std::optional<v1::ComputeEvent> Sandbox::next_event(std::chrono::steady_clock::time_point deadline) {
  v1::ComputeEvent event;
  if (ended()) return std::nullopt;
  switch (receive_message(channel_.get(), event, deadline)) {
    case Receipt::kMessage:
      return event;
    case Receipt::kEnded:
      channel_.close();
      break;
    case Receipt::kNothing:
      break;
  }
  return std::nullopt;
}

bool Sandbox::order(const v1::RunOrder& order, std::span<const int> files) {
  return !ended() && send_message(channel_.get(), order, files);
}

std::optional<Loss> Sandbox::loss() {
  v1::ComputeExit exit;
  const Receipt receipt = receive_message(requests_.get(), exit, std::chrono::steady_clock::now() + kEndGrace);
  log_errors();
  if (receipt == Receipt::kNothing) {
    kill();
    return Loss{.what = "closed its channel and did not end"};
  }
  if (receipt == Receipt::kEnded) {
    process_.signal(SIGKILL);
    return Loss{.what = process_.wait()};
  }
  if (exit.signal() == 0 && exit.code() == 0) return std::nullopt;
  return loss_of(exit, limits_);
}

void Sandbox::kill() {
  process_.signal(SIGKILL);
  process_.wait();
  channel_.close();
  log_errors();
}

void Sandbox::log_errors() {
  std::string text(kMostErrorBytes, '\0');
  const ssize_t count = ::read(errors_.get(), text.data(), text.size());
  if (count <= 0) return;
  text.resize(static_cast<std::size_t>(count));
  spdlog::warn("computing process {} says: {}", process_.id(), text);
  while (::read(errors_.get(), text.data(), text.size()) > 0) {
  }
}

}  // namespace creased
