#include "server/worker/sandbox.h"

#include <fmt/format.h>

#include <csignal>
#include <cstring>
#include <utility>
#include <vector>

#include "server/worker/channel.h"

namespace creased {
namespace v1 = crease::v1;
namespace {

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

Sandbox::Sandbox(const std::filesystem::path& executable) : Sandbox(executable, make_channel()) {}

Sandbox::Sandbox(const std::filesystem::path& executable, std::pair<Descriptor, Descriptor> ends)
    : process_({.executable = executable, .arguments = {"compute"}, .standard_streams = ends.second.get()}),
      requests_(std::move(ends.first)) {}

void Sandbox::start(const v1::ComputeTask& task, std::span<const int> files) {
  auto [ours, theirs] = make_channel();
  std::vector<int> all{theirs.get()};
  all.insert(all.end(), files.begin(), files.end());
  if (!send_message(requests_.get(), task, all)) {
    throw crease::Error(code::kInternal, "the computing process " + process_.wait());
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
  if (receive_message(requests_.get(), exit) != Receipt::kMessage) {
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
}

}  // namespace creased
