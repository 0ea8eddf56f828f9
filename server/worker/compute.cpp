#include <fmt/format.h>
#include <malloc.h>
#include <pthread.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <new>
#include <string_view>
#include <system_error>
#include <vector>

#include "core/base/heap.h"
#include "proto/assembly.h"
#include "proto/convert.h"
#include "proto/error_table.h"
#include "proto/parameter_table.h"
#include "proto/result_formats.h"
#include "server/worker/channel.h"
#include "server/worker/compute_run.h"
#include "server/worker/confinement.h"
#include "server/worker/mapped_file.h"
#include "server/worker/sandbox.h"

namespace creased {
namespace code = crease::code;
namespace v1 = crease::v1;
namespace {

constexpr int kTasks = STDIN_FILENO;

void inspect(const v1::ComputeTask& task, const TaskFiles& files) {
  const MappedFile upload(files.upload);
  std::optional<MappedFile> weights;
  if (files.weights >= 0) weights.emplace(files.weights);
  const auto input = crease::check_upload({.bytes = upload.bytes(),
                                           .format = task.inspect().format(),
                                           .name = task.inspect().name(),
                                           .weights = bytes_of(weights),
                                           .limits = files.limits});
  v1::ComputeEvent event;
  *event.mutable_inspected()->mutable_facts() = crease::to_message(input);
  for (const auto& warning : input.warnings) *event.mutable_inspected()->add_warnings() = crease::to_message(warning);
  send_message(files.channel, event);
}

void encode(const v1::EncodeTask& task, const TaskFiles& files) {
  const MappedFile stored(files.upload);
  std::optional<MappedFile> original;
  if (files.original >= 0) original.emplace(files.original);
  if (!write_all(files.output, crease::encode_stored(task, stored.bytes(), bytes_of(original).value_or(""))))
    throw write_failure(errno);
  v1::ComputeEvent event;
  event.set_encoded(true);
  send_message(files.channel, event);
}

void refuse(int channel, const crease::Error& error) {
  v1::ComputeEvent event;
  *event.mutable_refused() = crease::to_problem(error);
  send_message(channel, event);
}

void compute(const v1::ComputeTask& task, const TaskFiles& files) {
  try {
    if (task.has_run()) return run(task.run(), files);
    task.has_encode() ? encode(task.encode(), files) : inspect(task, files);
  } catch (const crease::Error& error) {
    refuse(files.channel, error);
  } catch (const std::bad_alloc&) {
    refuse(files.channel, {code::kMemoryExhausted,
                           fmt::format("needed more than {} MiB of memory", task.limits().memory_bytes() >> 20U)});
  } catch (const std::system_error& error) {
    const bool for_now = error.code() == std::errc::resource_unavailable_try_again;
    refuse(files.channel, {for_now ? code::kProcessUnavailable : code::kInternal,
                           std::string("the computation failed: ") + error.what()});
  } catch (const std::exception& error) {
    refuse(files.channel, {code::kInternal, std::string("the computation failed: ") + error.what()});
  }
}

TaskFiles task_files(const v1::ComputeTask& task, const std::vector<Descriptor>& received) {
  TaskFiles files;
  files.limits = {static_cast<std::size_t>(task.limits().max_vertices()),
                  static_cast<std::size_t>(task.limits().max_faces())};
  std::size_t next = 0;
  const auto take = [&](bool expected) { return expected && next < received.size() ? received[next++].get() : -1; };
  files.channel = take(true);
  files.upload = take(true);
  files.weights = take(task.has_weights());
  files.checkpoint = take(task.run().has_checkpoint());
  files.output = take(task.has_encode());
  files.original = take(task.encode().has_upload());
  return files;
}

/// Half of what the limit leaves beside the program: the rest is for stacks, files and a heap that grows further.
void reserve_heap_within(std::size_t limit, std::size_t program) {
  if (limit > program) crease::reserve_heap((limit - program) / 2);
}

/// Runs in the process of the task, which is confined before it reads the first byte of the upload.
[[noreturn]] void run_task(const v1::ComputeTask& task, const std::vector<Descriptor>& received,
                           const Confinement& confinement, std::size_t program, pid_t parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(1);
  ::close(STDIN_FILENO);
  ::close(STDOUT_FILENO);
  const TaskFiles files = task_files(task, received);
  try {
    confinement.enter(task.limits());
  } catch (const crease::Error& error) {
    refuse(files.channel, error);
    ::_exit(0);
  }
  reserve_heap_within(task.limits().memory_bytes(), program);
  compute(task, files);
  ::_exit(0);
}

v1::ComputeExit exit_of(pid_t task) {
  int status = 0;
  while (::waitpid(task, &status, 0) < 0 && errno == EINTR) {
  }
  v1::ComputeExit exit;
  if (WIFSIGNALED(status)) exit.set_signal(WTERMSIG(status));
  if (WIFEXITED(status)) exit.set_code(WEXITSTATUS(status));
  return exit;
}

/// Makes the address space of a process what its job needs. By default, each thread reserves 8 MiB for its stack and
/// 128 MiB for its allocations, which have their limit in common.
void reserve_little() {
  constexpr std::size_t kStack = 1U << 20U;
  ::mallopt(M_ARENA_MAX, 1);  // NOLINT(concurrency-mt-unsafe): before there are other threads
  pthread_attr_t attributes;
  if (::pthread_attr_init(&attributes) != 0) return;
  if (::pthread_attr_setstacksize(&attributes, kStack) == 0) ::pthread_setattr_default_np(&attributes);
  ::pthread_attr_destroy(&attributes);
}

/// Runs a small job, so that everything that is initialised at its first use is ready before the process forks for each
/// task.
void warm_up() {
  constexpr std::string_view kTetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  v1::Parameters parameters;
  parameters.set_sweeps(2);
  parameters.set_threads(1);
  const auto input = crease::check_input(kTetrahedron, crease::MeshFormat::kObj);
  crease::RunContext context;
  const auto output = crease::run_job(input, crease::to_options(crease::resolve(parameters)), context);
  v1::ComputeEvent event;
  *event.mutable_inspected()->mutable_facts() = crease::to_message(input);
  event.ParseFromString(event.SerializeAsString());
  v1::LabelledMesh mesh = crease::to_message(output.result);
  mesh.ParseFromString(mesh.SerializeAsString());
}

}  // namespace

int run_compute() {
  const Confinement confinement;
  reserve_little();
  warm_up();
  const std::size_t program = crease::address_space();
  const pid_t self = ::getpid();
  ThreadBudget threads;
  v1::ComputeTask task;
  std::vector<Descriptor> files;
  while (receive_message(kTasks, task, std::nullopt, &files) == Receipt::kMessage) {
    task.mutable_limits()->set_threads(threads.now());
    const pid_t child = ::fork();
    if (child == 0) run_task(task, files, confinement, program, self);
    if (child < 0) {
      refuse(files.front().get(), {code::kProcessUnavailable, "cannot start a process: " + errno_text(errno)});
    }
    files.clear();
    if (!send_message(kTasks, child < 0 ? v1::ComputeExit() : exit_of(child))) break;
  }
  return 0;
}

}  // namespace creased
