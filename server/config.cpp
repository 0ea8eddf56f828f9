#include "server/config.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <stdexcept>
#include <thread>

#include "server/http/cors.h"

namespace creased {
namespace {

std::string environment_name(const std::string& flag) {
  std::string name = "CREASED_";
  for (const char c : flag.substr(2))
    name += c == '-' ? '_' : static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return name;
}

template <typename T>
CLI::Option* add(CLI::App& command, const std::string& flag, T& value, const std::string& meaning) {
  return command.add_option(flag, value, meaning)->envname(environment_name(flag))->capture_default_str();
}

CLI::Option* add_path(CLI::App& command, const std::string& flag, std::filesystem::path& value,
                      const std::string& meaning) {
  const auto store = [&value](const std::string& text) { value = text; };
  return command.add_option_function<std::string>(flag, store, meaning)
      ->envname(environment_name(flag))
      ->default_str(value.string())
      ->type_name("PATH");
}

void add_log_options(CLI::App& command, LogConfig& config) {
  add(command, "--log-format", config.format, "Lines on standard error: text, or json for one object a line")
      ->check(CLI::IsMember({"text", "json"}));
  add(command, "--log-level", config.level, "Least important messages that are logged")
      ->check(CLI::IsMember({"trace", "debug", "info", "warning", "error", "critical", "off"}));
}

void add_store_options(CLI::App& command, StoreConfig& config) {
  add(command, "--store", config.url, "Where jobs are kept: sqlite");
  add_path(command, "--data-dir", config.data_dir, "Folder of the job store; made if it is not there");
}

void add_limit_options(CLI::App& command, MeshLimits& limits) {
  add(command, "--max-vertices", limits.max_vertices, "Vertices that an upload may have")
      ->check(CLI::Range(1UL, 1'000'000'000UL));
  add(command, "--max-faces", limits.max_faces, "Faces that an upload may have")
      ->check(CLI::Range(1UL, 1'000'000'000UL));
}

void add_job_options(CLI::App& command, JobConfig& config) {
  add(command, "--job-memory-mb", config.memory_mb, "Memory that a job may take, in MiB")
      ->check(CLI::Range(64UL, 1'048'576UL));
  add(command, "--job-cpu-seconds", config.cpu_seconds, "Processor time that an attempt of a job may take")
      ->check(CLI::Range(1.0, 1e7));
  add(command, "--checkpoint-every", config.checkpoint_every, "Seconds between checkpoints of a running job")
      ->check(CLI::Range(0.0, 86'400.0));
  add(command, "--lease", config.lease, "Seconds without a sign of life until another worker takes a job over")
      ->check(CLI::Range(0.1, 86'400.0));
}

CLI::Option* add_list(CLI::App& command, const std::string& flag, std::vector<std::string>& values,
                      const std::string& meaning) {
  return add(command, flag, values, meaning)->delimiter(',')->allow_extra_args(false)->type_name("TEXT,...");
}

void add_access_options(CLI::App& command, AccessConfig& config) {
  const auto many = CLI::Range(0UL, 1'000'000'000UL);
  const auto rate = CLI::Range(0.0, 1e6), burst = CLI::Range(1.0, 1e6);
  add_path(command, "--keys", config.keys, "File of API keys, made by `creased key`; read again on SIGHUP");
  command
      .add_flag("--open", config.open, "Let anyone who reaches --host use the service; off loopback, this or --keys")
      ->envname("CREASED_OPEN");
  add_list(command, "--trusted-proxy", config.trusted_proxies,
           "Addresses or blocks of proxies whose X-Forwarded-For is believed");
  add_list(command, "--cors-origin", config.cors_origins,
           "Origins whose pages may call from a browser; * with --open is any");
  add(command, "--max-connections-per-address", config.max_connections_per_address,
      "Connections that an address other than a trusted proxy may have open; 0: no bound")
      ->check(CLI::Range(0UL, 50'000UL));
  add(command, "--address-rate", config.address_rate,
      "Calls a second of an address, other than this machine's, without a key; 0: no bound")
      ->check(rate);
  add(command, "--address-burst", config.address_burst, "Calls that an address may make at once")->check(burst);
  add(command, "--key-rate", config.key_rate, "Calls a second of a key that does not say; 0: no bound")->check(rate);
  add(command, "--key-burst", config.key_burst, "Calls that a key may make at once that does not say")->check(burst);
  add(command, "--key-jobs-per-minute", config.key_jobs_per_minute,
      "Jobs a minute of a key that does not say; 0: no bound")
      ->check(rate);
  add(command, "--key-max-queued", config.key_max_queued,
      "Jobs that may wait of a key that does not say; 0: no bound of its own")
      ->check(many);
  add(command, "--key-max-stored-mb", config.key_max_stored_mb,
      "Space for the jobs of a key that does not say, in MiB; 0: no bound of its own")
      ->check(many);
  add(command, "--key-max-streams", config.key_max_streams,
      "Event streams of a key that does not say; 0: no bound of its own")
      ->check(many);
}

void add_service_limits(CLI::App& command, ServeConfig& config) {
  const auto hours = CLI::Range(0.0, 8'760.0);
  add(command, "--max-upload-mb", config.max_upload_mb, "Size of an upload, in MiB")->check(CLI::Range(1UL, 4'095UL));
  add(command, "--max-queued", config.store.max_queued, "Jobs that may wait")->check(CLI::Range(1UL, 10'000'000UL));
  add(command, "--quota-mb", config.store.quota_mb, "Space that all jobs may take together, in MiB; 0: the disk's")
      ->check(CLI::Range(0UL, 1'000'000'000UL));
  add(command, "--retention-hours", config.retention_hours, "Hours that a job is kept after its end unless it says")
      ->check(hours);
  add(command, "--max-retention-hours", config.max_retention_hours, "Hours that a job may ask to be kept")
      ->check(hours);
  add(command, "--max-streams", config.max_streams, "Event streams open at a time")->check(CLI::Range(0UL, 50'000UL));
  add(command, "--max-connections", config.max_connections, "Connections open at a time, each with a thread")
      ->check(CLI::Range(1UL, 50'000UL));
}

void add_timeouts(CLI::App& command, ServeConfig& config) {
  const auto seconds = CLI::Range(0.05, 86'400.0);
  add(command, "--head-timeout", config.head_timeout, "Seconds for the head of a request to arrive")->check(seconds);
  add(command, "--body-timeout", config.body_timeout, "Seconds for a body, or for a pause in one")->check(seconds);
  add(command, "--idle-timeout", config.idle_timeout, "Seconds between two requests of a connection")->check(seconds);
}

bool is_loopback(const std::string& host) { return host == "localhost" || host == "::1" || host.rfind("127.", 0) == 0; }

std::string access_refusal(const ServeConfig& config) {
  const AccessConfig& access = config.access;
  if (!access.keys.empty() && access.open) return "--keys and --open contradict each other";
  if (!is_loopback(config.host) && access.keys.empty() && !access.open) {
    return "listening on " + config.host +
           " lets anyone who reaches it use the service; give --keys FILE, say --open if that is meant, or listen on "
           "127.0.0.1";
  }
  for (const auto& origin : access.cors_origins) {
    if (origin == "*" ? !access.open : !is_origin(origin)) {
      return "--cors-origin " + origin + " is not an origin like https://example.org, nor * together with --open";
    }
  }
  try {
    AddressList(access.trusted_proxies);
  } catch (const std::invalid_argument& error) {
    return std::string("--trusted-proxy ") + error.what();
  }
  return {};
}

}  // namespace

void add_serve_options(CLI::App& command, ServeConfig& config) {
  config.workers = std::max(1U, std::thread::hardware_concurrency() / 2);
  add(command, "--host", config.host, "Address to listen on");
  add(command, "--port", config.port, "Port to listen on; 0 takes any free one")->check(CLI::Range(0, 65'535));
  add_path(command, "--port-file", config.port_file, "File that gets the port once it is listened on");
  add_store_options(command, config.store);
  add(command, "--workers", config.workers, "Worker processes; the default is one for two processors")
      ->check(CLI::Range(0UL, 1'024UL));
  add_log_options(command, config.log);
  command.option_defaults()->group("Who may call");
  add_access_options(command, config.access);
  command.option_defaults()->group("Limits");
  add_service_limits(command, config);
  add_limit_options(command, config.limits);
  add_job_options(command, config.job);
  add_timeouts(command, config);
}

void add_worker_options(CLI::App& command, WorkerConfig& config) {
  add(command, "--name", config.name, "Name under which jobs are claimed; the default is host and process id");
  add_store_options(command, config.store);
  add_limit_options(command, config.limits);
  add_job_options(command, config.job);
  add_log_options(command, config.log);
}

void add_key_options(CLI::App& command, KeyConfig& config) {
  command.add_option("name", config.name, "Whose key it is, for people: 1 to 100 bytes")
      ->required()
      ->check([](const std::string& name) {
        return name.empty() || name.size() > kMaxKeyNameBytes ? "a name has 1 to 100 bytes" : "";
      });
  add_path(command, "--keys", config.keys, "File that gets the entry; without it the entry is printed");
}

Gatekeeper::Options gatekeeper_options(const ServeConfig& config) {
  const AccessConfig& access = config.access;
  Limits open;
  open.max_upload_mb = config.max_upload_mb;
  open.max_faces = config.limits.max_faces;
  open.requests = {access.address_rate, access.address_burst};
  Limits key = open;
  key.max_queued = access.key_max_queued;
  key.max_stored_mb = access.key_max_stored_mb;
  key.max_streams = access.key_max_streams;
  key.requests = {access.key_rate, access.key_burst};
  key.jobs_per_minute = access.key_jobs_per_minute;
  return {access.keys, open, key};
}

std::string refusal(const ServeConfig& config) {
  if (const std::string reason = access_refusal(config); !reason.empty()) return reason;
  if (config.retention_hours > config.max_retention_hours) {
    return "--retention-hours must not be more than --max-retention-hours";
  }
  if (config.max_streams >= config.max_connections) {
    return "--max-streams must be less than --max-connections, or event streams shut all other calls out";
  }
  return {};
}

std::chrono::milliseconds milliseconds_of(double seconds) {
  return std::chrono::milliseconds(static_cast<std::int64_t>(seconds * 1000));
}

WorkerOptions worker_options(const WorkerConfig& config) {
  WorkerOptions options;
  options.name = config.name;
  options.lease = milliseconds_of(config.job.lease);
  options.checkpoint_every = milliseconds_of(config.job.checkpoint_every);
  options.memory_bytes = std::uint64_t{config.job.memory_mb} << 20U;
  options.cpu_seconds = static_cast<std::uint64_t>(std::ceil(config.job.cpu_seconds));
  options.limits = {config.limits.max_vertices, config.limits.max_faces};
  return options;
}

StoreOptions store_options(const StoreConfig& config) {
  StoreOptions options;
  options.url = config.url;
  options.data_dir = config.data_dir;
  options.max_queued = config.max_queued;
  options.quota_bytes = std::uint64_t{config.quota_mb} << 20U;
  return options;
}

std::vector<std::string> worker_arguments(const ServeConfig& config) {
  return {"worker",
          "--store",
          config.store.url,
          "--data-dir",
          config.store.data_dir.string(),
          "--max-vertices",
          std::to_string(config.limits.max_vertices),
          "--max-faces",
          std::to_string(config.limits.max_faces),
          "--job-memory-mb",
          std::to_string(config.job.memory_mb),
          "--job-cpu-seconds",
          std::to_string(config.job.cpu_seconds),
          "--checkpoint-every",
          std::to_string(config.job.checkpoint_every),
          "--lease",
          std::to_string(config.job.lease),
          "--log-format",
          config.log.format,
          "--log-level",
          config.log.level};
}

}  // namespace creased
