#pragma once

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/options/options.h"
#include "server/access/gatekeeper.h"
#include "server/base/cgroup.h"
#include "server/store/store.h"
#include "server/worker/worker.h"

namespace creased {

struct LogConfig {
  std::string format = "text";  ///< text or json
  std::string level = "info";
};

struct StoreConfig {
  std::string url = "sqlite";
  std::filesystem::path data_dir = "creased-data";
  std::size_t max_queued = 10'000;
  std::size_t quota_mb = 0;        ///< for all jobs together; 0 for no limit but the disk
  std::string orphans = "refuse";  ///< refuse, adopt or discard
};

/// Settings of a worker for the jobs that it runs. Times are in seconds.
struct JobConfig {
  std::size_t memory_mb = 8'192;  ///< address space of a job's process
  double cpu_seconds = 3'600;     ///< processor time of one attempt, all threads together
  double checkpoint_every = 10;
  double lease = 15;  ///< time without renewal after which another worker takes the job over
};

struct MeshLimits {
  std::size_t max_vertices = 20'000'000;
  std::size_t max_faces = 20'000'000;
};

/// Who may call the service, and how much.
struct AccessConfig {
  std::filesystem::path keys;  ///< empty for a service without keys
  bool open = false;           ///< allows a public address without keys
  std::vector<std::string> trusted_proxies, cors_origins;
  std::size_t max_connections_per_address = 1'250;  ///< 0 for no limit
  double address_rate = 100, address_burst = 1'000;
  // Limits of keys whose entries do not set them; 0 for no limit.
  std::size_t key_max_queued = 1'000, key_max_stored_mb = 0, key_max_streams = 100;
  double key_rate = 100, key_burst = 1'000, key_jobs_per_minute = 0;
};

/// Settings of `creased serve`. Times are in seconds.
struct ServeConfig {
  LogConfig log;
  StoreConfig store;
  MeshLimits limits;
  JobConfig job;
  AccessConfig access;
  double retention_hours = crease::JobOptions{}.retention_hours;  ///< default of the parameter retention_hours
  double max_retention_hours = 720;
  std::string host = "127.0.0.1";
  int port = 8080;
  std::filesystem::path port_file;
  std::string base_path;           ///< what clients have before each path; empty for nothing
  std::filesystem::path page_dir;  ///< empty for the page that is installed with the binary
  std::size_t workers = 1;
  std::size_t threads = 1;  ///< of a job that asks for none
  std::size_t max_upload_mb = 512;
  std::size_t max_streams = 1'000;
  std::size_t max_connections = 1'500;
  double head_timeout = 10;
  double body_timeout = 30;
  double idle_timeout = 60;
};

/// Settings of `creased worker`.
struct WorkerConfig {
  LogConfig log;
  StoreConfig store;
  MeshLimits limits;
  JobConfig job;
  std::string name;  ///< empty for host and process id
};

/// Arguments of `creased key`.
struct KeyConfig {
  std::string name;
  std::filesystem::path keys;  ///< empty to print the entry
};

/// Sets workers, threads and the memory of a job to what control groups allow: those of this process unless others are
/// given.
void use_allowance(ServeConfig& config, const Allowance& allowed = allowance());
void use_allowance(WorkerConfig& config, const Allowance& allowed = allowance());

/// Adds the options of a command, each with its default and its environment variable CREASED_*.
void add_serve_options(CLI::App& command, ServeConfig& config);
void add_worker_options(CLI::App& command, WorkerConfig& config);
void add_key_options(CLI::App& command, KeyConfig& config);

/// Reads files of options strictly: a line, table or key that means nothing is refused by name, and what the
/// environment sets goes before the file.
std::shared_ptr<CLI::Config> strict_config(const CLI::App& app);

/// Lets keys go before an `open` that was inherited from the environment, as an image may set it.
void prefer_keys(AccessConfig& access);

/// Why this configuration is not valid; empty when it is.
std::string refusal(const ServeConfig& config);

/// How callers are identified and limited.
Gatekeeper::Options gatekeeper_options(const ServeConfig& config);

std::chrono::milliseconds milliseconds_of(double seconds);
StoreOptions store_options(const StoreConfig& config);
WorkerOptions worker_options(const WorkerConfig& config);

/// The arguments for a worker that shares the server's store.
std::vector<std::string> worker_arguments(const ServeConfig& config);

}  // namespace creased
