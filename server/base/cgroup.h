#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace creased {

/// What the control groups of a process leave of the machine; nullopt for all of it.
struct Allowance {
  std::optional<double> processors;
  std::optional<std::uint64_t> memory_bytes;
};

/// The strictest limits of the groups that `groups` names (the text of /proc/self/cgroup) and of those above them, in
/// the file systems below `root`. Reads version 2 (cpu.max, memory.max) and version 1 (cpu.cfs_quota_us,
/// memory.limit_in_bytes). A group that cannot be seen, as from inside a container, is looked for at the root.
Allowance allowance_of(const std::filesystem::path& root, const std::string& groups);
/// That of this process.
Allowance allowance();

/// How many processors the process may use: those of the machine, or fewer by its control groups, rounded up; at least
/// one.
std::size_t usable_processors(const Allowance& allowance, std::size_t of_machine);

/// Address space for a job, in MiB: `most`, or an equal part for each of `processes` of what the control groups leave
/// after the server's own share; at least 64.
std::size_t memory_per_job_mb(const Allowance& allowance, std::size_t processes, std::size_t most);

/// How many of `most` processes for jobs can have `each_mb` MiB; at least one.
std::size_t affordable_processes(const Allowance& allowance, std::size_t most, std::size_t each_mb);

}  // namespace creased
