#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace crease::test {

/// Lists the faults of the store in a data directory, which may be in use: a damaged database, accepted jobs that are
/// missing, uploads that do not match their hash, results that are missing, incomplete or left over, and wrong sums of
/// usage. With `at_rest` the store is not in use, so unfinished work is a fault, too.
std::vector<std::string> faults_of_store(const std::filesystem::path& data_dir,
                                         const std::set<std::string>& acknowledged, bool at_rest = false);

/// Likewise of a store in PostgreSQL.
std::vector<std::string> faults_of_shared_store(const std::string& url, const std::set<std::string>& acknowledged,
                                                bool at_rest = false);

/// The processes of a server that run jobs. `kind` is "worker", "compute" (a worker's process that starts tasks) or
/// "task".
std::vector<int> processes_below(int server, const std::string& kind);

}  // namespace crease::test
