#include "server/worker/confinement.h"

#include <fcntl.h>
#include <grp.h>
#include <linux/landlock.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <seccomp.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>

#include "core/base/sanitized.h"
#include "core/error.h"
#include "server/base/durable_file.h"
#include "server/base/failure.h"

namespace creased {
namespace code = crease::code;
namespace {

// Stands for the id of the confined process in the compiled filter: no process has it.
constexpr std::uint32_t kOwnProcess = 0x7ffffff5;

using Filter = std::unique_ptr<void, decltype(&::seccomp_release)>;

crease::Error failure(std::string_view what, int number) {
  return {code::kInternal, "cannot confine the process (" + std::string(what) + "): " + errno_text(number)};
}

void check(int result, std::string_view what) {
  if (result < 0) throw failure(what, -result);
}

template <class... Condition>
void rule(const Filter& filter, std::uint32_t action, int call, Condition... condition) {
  check(::seccomp_rule_add(filter.get(), action, call, sizeof...(condition), condition...), "rule");
}

/// Does what the C macros SCMP_A0 to SCMP_A5 do.
scmp_arg_cmp argument(unsigned number, scmp_compare comparison, scmp_datum_t a, scmp_datum_t b = 0) {
  return {number, comparison, a, b};
}

void allow_computing(const Filter& filter) {
  for (const int call : {SCMP_SYS(read),
                         SCMP_SYS(write),
                         SCMP_SYS(readv),
                         SCMP_SYS(writev),
                         SCMP_SYS(pread64),
                         SCMP_SYS(pwrite64),
                         SCMP_SYS(lseek),
                         SCMP_SYS(fstat),
                         SCMP_SYS(ftruncate),
                         SCMP_SYS(close),
                         SCMP_SYS(recvmsg),
                         SCMP_SYS(sendmsg),
                         SCMP_SYS(poll),
                         SCMP_SYS(ppoll),
                         SCMP_SYS(mmap),
                         SCMP_SYS(munmap),
                         SCMP_SYS(mremap),
                         SCMP_SYS(mprotect),
                         SCMP_SYS(madvise),
                         SCMP_SYS(brk),
                         SCMP_SYS(futex),
                         SCMP_SYS(set_robust_list),
                         SCMP_SYS(rseq),
                         SCMP_SYS(sched_yield),
                         SCMP_SYS(sched_getaffinity),
                         SCMP_SYS(getcpu),
                         SCMP_SYS(membarrier),
                         SCMP_SYS(exit),
                         SCMP_SYS(exit_group),
                         SCMP_SYS(rt_sigaction),
                         SCMP_SYS(rt_sigprocmask),
                         SCMP_SYS(rt_sigreturn),
                         SCMP_SYS(sigaltstack),
                         SCMP_SYS(restart_syscall),
                         SCMP_SYS(clock_gettime),
                         SCMP_SYS(clock_nanosleep),
                         SCMP_SYS(gettimeofday),
                         SCMP_SYS(time),
                         SCMP_SYS(getpid),
                         SCMP_SYS(gettid),
                         SCMP_SYS(getrandom),
                         SCMP_SYS(sysinfo),
                         SCMP_SYS(uname)}) {
    rule(filter, SCMP_ACT_ALLOW, call);
  }
  // Allow threads but not processes. A filter cannot see the flags of clone3, so clone3 fails as if the kernel lacked
  // it.
  rule(filter, SCMP_ACT_ALLOW, SCMP_SYS(clone), argument(0, SCMP_CMP_MASKED_EQ, CLONE_THREAD, CLONE_THREAD));
  rule(filter, SCMP_ACT_ERRNO(ENOSYS), SCMP_SYS(clone3));
  // Newer libraries implement fstat() with this call. With a path it would reveal other files.
  rule(filter, SCMP_ACT_ALLOW, SCMP_SYS(newfstatat), argument(3, SCMP_CMP_EQ, AT_EMPTY_PATH));
  // Reading limits is allowed, setting them is not.
  rule(filter, SCMP_ACT_ALLOW, SCMP_SYS(prlimit64), argument(2, SCMP_CMP_EQ, 0));
  // For abort() and raise(): in this process only, whose id enter() puts in.
  rule(filter, SCMP_ACT_ALLOW, SCMP_SYS(tgkill), argument(0, SCMP_CMP_EQ, kOwnProcess),
       argument(2, SCMP_CMP_EQ, SIGABRT));
}

/// Kills the process for calls that only an attack would make.
void kill_for_escaping(const Filter& filter) {
  for (const int call : {SCMP_SYS(execve),
                         SCMP_SYS(execveat),
                         SCMP_SYS(fork),
                         SCMP_SYS(vfork),
                         SCMP_SYS(ptrace),
                         SCMP_SYS(socket),
                         SCMP_SYS(connect),
                         SCMP_SYS(bind),
                         SCMP_SYS(listen),
                         SCMP_SYS(accept),
                         SCMP_SYS(accept4),
                         SCMP_SYS(mount),
                         SCMP_SYS(setns),
                         SCMP_SYS(unshare),
                         SCMP_SYS(bpf),
                         SCMP_SYS(process_vm_readv),
                         SCMP_SYS(process_vm_writev),
                         SCMP_SYS(keyctl),
                         SCMP_SYS(io_uring_setup),
                         SCMP_SYS(userfaultfd),
                         SCMP_SYS(kill)}) {
    rule(filter, SCMP_ACT_KILL_PROCESS, call);
  }
}

std::vector<sock_filter> compiled(const Filter& filter) {
  const Descriptor file(static_cast<int>(::syscall(SYS_memfd_create, "filter", MFD_CLOEXEC)));
  if (!file.open()) throw failure("memory file", errno);
  check(::seccomp_export_bpf(filter.get(), file.get()), "export");
  struct stat status {};
  if (::fstat(file.get(), &status) != 0) throw failure("size", errno);
  std::vector<sock_filter> program(static_cast<std::size_t>(status.st_size) / sizeof(sock_filter));
  const std::size_t bytes = program.size() * sizeof(sock_filter);
  if (::pread(file.get(), program.data(), bytes, 0) != static_cast<ssize_t>(bytes)) throw failure("read", errno);
  return program;
}

void limit(__rlimit_resource resource, rlim_t soft, rlim_t hard) {
  const rlimit value{soft, hard};
  if (::setrlimit(resource, &value) != 0) throw failure("limit", errno);
}

void limit(__rlimit_resource resource, rlim_t value) { limit(resource, value, value); }

/// Lowers a limit without raising what is lower already.
void lower(__rlimit_resource resource, rlim_t value) {
  rlimit present{};
  if (::getrlimit(resource, &present) != 0) throw failure("limit", errno);
  limit(resource, std::min(value, present.rlim_max));
}

/// The user that tasks run as: nobody, when this is the superuser.
uid_t task_user() {
  constexpr uid_t kNobody = 65'534;
  return ::geteuid() == 0 ? kNobody : ::geteuid();
}

/// The superuser has no limits of threads and owns too much. Where another user is not to be had, as in a container
/// without capabilities, the rest of the confinement has to do.
void leave_root() {
  const uid_t user = task_user();
  if (user == ::geteuid() || crease::kSanitized) return;
  if (::setgroups(0, nullptr) != 0 || ::setgid(user) != 0 || ::setuid(user) != 0) return;
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // a change of the user has cleared it
}

/// With Landlock, where the kernel has it: no file can be opened even if the filter let it through.
void forbid_files() {
  landlock_ruleset_attr rules{};
  rules.handled_access_fs = (LANDLOCK_ACCESS_FS_MAKE_SYM << 1U) - 1;  // everything that its first version knows
  const Descriptor ruleset(static_cast<int>(::syscall(SYS_landlock_create_ruleset, &rules, sizeof rules, 0)));
  if (!ruleset.open()) return;
  if (::syscall(SYS_landlock_restrict_self, ruleset.get(), 0) != 0) throw failure("landlock", errno);
}

/// Whether this process sees all processes of its machine, as those of a container do not.
bool sees_all_processes() {
  constexpr ino_t kFirstNamespace = 0xEFFFFFFC;  // PROC_PID_INIT_INO of every kernel
  struct stat space {};
  return ::stat("/proc/self/ns/pid", &space) == 0 && space.st_ino == kFirstNamespace;
}

/// The number of threads that a user has on this machine.
std::uint64_t threads_of(uid_t user) {
  std::uint64_t sum = 0;
  std::error_code failed;
  for (std::filesystem::directory_iterator entry("/proc", failed), end; !failed && entry != end;
       entry.increment(failed)) {
    std::ifstream status(entry->path() / "status");
    std::uint64_t owner = 0, threads = 0;
    for (std::string word; status >> word;) {
      if (word == "Uid:") status >> owner;
      if (word == "Threads:") status >> threads;
    }
    if (owner == user) sum += threads;
  }
  return sum;
}

}  // namespace

Confinement::Confinement() {
  if (crease::kSanitized) return;
  const Filter filter(::seccomp_init(SCMP_ACT_ERRNO(EPERM)), &::seccomp_release);
  if (filter == nullptr) throw failure("filter", ENOMEM);
  allow_computing(filter);
  kill_for_escaping(filter);
  program_ = compiled(filter);
}

void Confinement::enter(const crease::v1::ComputeLimits& limits) const {
  constexpr rlim_t kDescriptors = 32;
  ::signal(SIGXFSZ, SIG_IGN);  // writing beyond the file size limit makes write() fail instead
  leave_root();
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_NOFILE, kDescriptors);
  if (limits.file_bytes() > 0) limit(RLIMIT_FSIZE, limits.file_bytes());
  if (limits.cpu_seconds() > 0) limit(RLIMIT_CPU, limits.cpu_seconds(), limits.cpu_seconds() + 1);
  if (limits.memory_bytes() > 0 && !crease::kSanitized) limit(RLIMIT_AS, limits.memory_bytes());
  if (limits.threads() > 0 && !crease::kSanitized) lower(RLIMIT_NPROC, limits.threads());
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) throw failure("no new privileges", errno);
  if (::prctl(PR_SET_DUMPABLE, 0, 0, 0, 0) != 0) throw failure("no inspection by others", errno);
  if (program_.empty()) return;
  forbid_files();
  std::vector<sock_filter> filter = program_;
  for (sock_filter& step : filter) {
    if (BPF_CLASS(step.code) == BPF_JMP && step.k == kOwnProcess) step.k = static_cast<std::uint32_t>(::getpid());
  }
  const sock_fprog program{static_cast<unsigned short>(filter.size()), filter.data()};
  if (::syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, 0, &program) != 0) throw failure("filter", errno);
}

std::uint64_t ThreadBudget::now() {
  constexpr std::chrono::seconds kValid{10};
  constexpr std::uint64_t kForAll = 256, kPerProcessor = 64;
  if (!sees_all_processes()) return 0;
  const auto time = std::chrono::steady_clock::now();
  if (limit_ == 0 || time - counted_ > kValid) {
    counted_ = time;
    limit_ = threads_of(task_user()) + kForAll + kPerProcessor * std::thread::hardware_concurrency();
  }
  return limit_;
}

}  // namespace creased
