#include "server/base/cgroup.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <sstream>
#include <vector>

namespace creased {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kServerShareMb = 512;  // of the HTTP process and the workers
constexpr std::size_t kLeastJobMb = 64;

std::string text_of(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The number that a file begins with; nullopt for "max", −1, and without a file.
std::optional<double> number_in(const fs::path& path) {
  std::istringstream text(text_of(path));
  double number = 0;
  if (!(text >> number) || number < 0) return std::nullopt;
  return number;
}

template <typename Number>
void lower(std::optional<Number>& limit, std::optional<double> found) {
  if (!found) return;
  const auto number = static_cast<Number>(*found);
  limit = limit ? std::min(*limit, number) : number;
}

/// Version 2: "200000 100000", the time in each period and the period.
std::optional<double> quota_in(const fs::path& path) {
  std::istringstream text(text_of(path));
  double quota = 0, period = 0;
  if (!(text >> quota >> period) || quota <= 0 || period <= 0) return std::nullopt;
  return quota / period;
}

void look_at(const fs::path& folder, Allowance& allowance) {
  lower(allowance.processors, quota_in(folder / "cpu.max"));
  lower(allowance.memory_bytes, number_in(folder / "memory.max"));
  const auto quota = number_in(folder / "cpu.cfs_quota_us"), period = number_in(folder / "cpu.cfs_period_us");
  if (quota && period && *quota > 0 && *period > 0) lower(allowance.processors, std::optional(*quota / *period));
  constexpr double kNoLimit = 1e18;  // version 1 writes a number of about 2⁶³ for none
  const auto bytes = number_in(folder / "memory.limit_in_bytes");
  if (bytes && *bytes < kNoLimit) lower(allowance.memory_bytes, bytes);
}

/// Looks at a group and at all above it.
void climb(const fs::path& mount, const fs::path& group, Allowance& allowance) {
  for (fs::path path = group.lexically_normal().relative_path();; path = path.parent_path()) {
    look_at(mount / path, allowance);
    if (path.empty()) return;
  }
}

}  // namespace

Allowance allowance_of(const fs::path& root, const std::string& groups) {
  Allowance allowance;
  std::istringstream lines(groups);
  for (std::string line; std::getline(lines, line);) {
    const auto first = line.find(':'), second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    // A line is "number:controllers:group". Version 2 has no controllers; a mount of version 1 is named after them.
    const std::string controllers = line.substr(first + 1, second - first - 1);
    const fs::path group = line.substr(second + 1);
    climb(controllers.empty() ? root : root / controllers, group, allowance);
    if (controllers.empty()) climb(root / "unified", group, allowance);
  }
  return allowance;
}

Allowance allowance() { return allowance_of("/sys/fs/cgroup", text_of("/proc/self/cgroup")); }

std::size_t usable_processors(const Allowance& allowance, std::size_t of_machine) {
  const double allowed = std::ceil(allowance.processors.value_or(static_cast<double>(of_machine)));
  return std::max<std::size_t>(1, std::min(of_machine, static_cast<std::size_t>(allowed)));
}

std::size_t memory_per_job_mb(const Allowance& allowance, std::size_t processes, std::size_t most) {
  if (!allowance.memory_bytes) return most;
  const std::size_t all = *allowance.memory_bytes >> 20U, server = std::min(kServerShareMb, all / 4);
  return std::clamp((all - server) / std::max<std::size_t>(1, processes), kLeastJobMb, most);
}

std::size_t affordable_processes(const Allowance& allowance, std::size_t most, std::size_t each_mb) {
  std::size_t processes = std::max<std::size_t>(1, most);
  while (processes > 1 && memory_per_job_mb(allowance, processes, each_mb) < each_mb) --processes;
  return processes;
}

}  // namespace creased
