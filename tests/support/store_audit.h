#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace crease::test {

/// What is wrong with the store in a data directory, read beside whoever works with it: damage of the database, jobs
/// that were acknowledged and are not there, uploads whose bytes are not those of their hash, results that are
/// missing, half written or left over, sums that do not add up. `at_rest`: nobody works with it any more, so nothing
/// may be under way either.
std::vector<std::string> faults_of_store(const std::filesystem::path& data_dir,
                                         const std::set<std::string>& acknowledged, bool at_rest = false);

/// Processes of a server that run jobs: "worker", "compute" (of a worker, which starts tasks) and "task".
std::vector<int> processes_below(int server, const std::string& kind);

}  // namespace crease::test
