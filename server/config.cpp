#include "server/config.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <istream>
#include <iterator>
#include <set>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "server/transport/cors.h"
#include "server/transport/http_head.h"

namespace creased {
namespace {

constexpr std::size_t kUsefulJobMb = 512;  // for about 200,000 faces; fewer workers rather than less for each

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
  add(command, "--log-format", config.format,
      "Format of the log on standard error: text, or json for one object per line")
      ->check(CLI::IsMember({"text", "json"}));
  add(command, "--log-level", config.level, "Lowest level of messages to log")
      ->check(CLI::IsMember({"trace", "debug", "info", "warning", "error", "critical", "off"}));
}

void add_store_options(CLI::App& command, StoreConfig& config) {
  add(command, "--store", config.url,
      "Job store: sqlite, or postgresql://… for any number of servers and workers on any number of machines");
  add_path(
      command, "--data-dir", config.data_dir,
      "Folder of the job store, created if it does not exist. With a store in PostgreSQL, the folder of this machine's "
      "temporary files");
}

void add_limit_options(CLI::App& command, MeshLimits& limits) {
  add(command, "--max-vertices", limits.max_vertices, "Maximum number of vertices of an upload")
      ->check(CLI::Range(1UL, 1'000'000'000UL));
  add(command, "--max-faces", limits.max_faces, "Maximum number of faces of an upload")
      ->check(CLI::Range(1UL, 1'000'000'000UL));
}

void add_job_options(CLI::App& command, JobConfig& config) {
  add(command, "--job-memory-mb", config.memory_mb,
      "Maximum memory of a job, in MiB; a job that may need more is refused")
      ->check(CLI::Range(64UL, 1'048'576UL));
  add(command, "--job-cpu-seconds", config.cpu_seconds, "Maximum processor time of one attempt of a job, in seconds")
      ->check(CLI::Range(1.0, 1e7));
  add(command, "--checkpoint-every", config.checkpoint_every, "Seconds between checkpoints of a running job")
      ->check(CLI::Range(0.0, 86'400.0));
  add(command, "--lease", config.lease,
      "Seconds after which another worker takes over a job whose worker has stopped responding")
      ->check(CLI::Range(0.1, 86'400.0));
}

CLI::Option* add_list(CLI::App& command, const std::string& flag, std::vector<std::string>& values,
                      const std::string& meaning) {
  return add(command, flag, values, meaning)->delimiter(',')->allow_extra_args(false)->type_name("TEXT,...");
}

void add_access_options(CLI::App& command, AccessConfig& config) {
  const auto many = CLI::Range(0UL, 1'000'000'000UL);
  const auto rate = CLI::Range(0.0, 1e6), burst = CLI::Range(1.0, 1e6);
  add_path(command, "--keys", config.keys, "File of API keys, made by `creased key`. SIGHUP reloads it");
  command
      .add_flag(
          "--open", config.open,
          "Allow calls without a key from anyone who can reach --host. A host other than loopback needs this or --keys")
      ->envname("CREASED_OPEN");
  add_list(command, "--trusted-proxy", config.trusted_proxies,
           "Addresses or blocks of proxies whose headers X-Forwarded-For and X-Forwarded-Prefix are trusted");
  add_list(command, "--cors-origin", config.cors_origins,
           "Origins whose web pages may call the service; * allows any and needs --open");
  add(command, "--max-connections-per-address", config.max_connections_per_address,
      "Maximum number of connections from one address, trusted proxies excepted; 0 for no limit")
      ->check(CLI::Range(0UL, 50'000UL));
  add(command, "--address-rate", config.address_rate,
      "Calls per second from one address without a key, this machine excepted; 0 for no limit")
      ->check(rate);
  add(command, "--address-burst", config.address_burst, "Calls that one address may make in a burst")->check(burst);
  add(command, "--key-rate", config.key_rate,
      "Calls per second with one key, unless its entry sets one; 0 for no limit")
      ->check(rate);
  add(command, "--key-burst", config.key_burst, "Calls that one key may make in a burst, unless its entry sets one")
      ->check(burst);
  add(command, "--key-jobs-per-minute", config.key_jobs_per_minute,
      "Jobs per minute with one key, unless its entry sets one; 0 for no limit")
      ->check(rate);
  add(command, "--key-max-queued", config.key_max_queued,
      "Maximum number of queued jobs of one key, unless its entry sets one; 0 for no limit per key")
      ->check(many);
  add(command, "--key-max-stored-mb", config.key_max_stored_mb,
      "Maximum space for the jobs of one key, in MiB, unless its entry sets one; 0 for no limit per key")
      ->check(many);
  add(command, "--key-max-streams", config.key_max_streams,
      "Maximum number of event streams of one key, unless its entry sets one; 0 for no limit per key")
      ->check(many);
}

void add_service_limits(CLI::App& command, ServeConfig& config) {
  const auto hours = CLI::Range(0.0, 8'760.0);
  add(command, "--max-upload-mb", config.max_upload_mb, "Maximum size of an upload, in MiB")
      ->check(CLI::Range(1UL, 4'095UL));
  add(command, "--max-queued", config.store.max_queued, "Maximum number of queued jobs")
      ->check(CLI::Range(1UL, 10'000'000UL));
  add(command, "--quota-mb", config.store.quota_mb, "Maximum space for all jobs together, in MiB; 0 for the whole disk")
      ->check(CLI::Range(0UL, 1'000'000'000UL));
  add(command, "--retention-hours", config.retention_hours,
      "Hours that a job is kept after its end: the default of the parameter retention_hours")
      ->check(hours);
  add(command, "--max-retention-hours", config.max_retention_hours, "Maximum value of the parameter retention_hours")
      ->check(hours);
  add(command, "--max-streams", config.max_streams, "Maximum number of event streams")
      ->check(CLI::Range(0UL, 50'000UL));
  add(command, "--max-connections", config.max_connections, "Maximum number of connections; each has a thread")
      ->check(CLI::Range(1UL, 50'000UL));
}

void add_timeouts(CLI::App& command, ServeConfig& config) {
  const auto seconds = CLI::Range(0.05, 86'400.0);
  add(command, "--head-timeout", config.head_timeout, "Seconds in which the head of a request must arrive")
      ->check(seconds);
  add(command, "--body-timeout", config.body_timeout,
      "Seconds in which a short body must arrive; also the longest pause in a body")
      ->check(seconds);
  add(command, "--idle-timeout", config.idle_timeout, "Seconds after which an idle connection is closed")
      ->check(seconds);
}

/// CLI11's reader of TOML and INI, which passes over what it does not know, behind checks of every line and name.
class StrictConfig final : public CLI::ConfigTOML {
 public:
  explicit StrictConfig(const CLI::App& app) : app_(app) {}

  std::vector<CLI::ConfigItem> from_config(std::istream& input) const override {
    const std::string text(std::istreambuf_iterator<char>(input), {});
    check_lines(text);
    std::istringstream checked(text);
    std::vector<CLI::ConfigItem> kept;
    std::set<std::string> seen;
    for (auto& item : CLI::ConfigTOML::from_config(checked)) {
      if (item.name == "++" || item.name == "--") {  // how CLI11 marks where a table begins and ends
        check_table(item.parents);
        kept.push_back(std::move(item));
        continue;
      }
      const CLI::Option& option = option_of(item);
      if (!seen.insert(item.fullname()).second) fail("the key '" + item.fullname() + "' is given twice");
      const std::string& variable = option.get_envname();
      if (variable.empty() || std::getenv(variable.c_str()) == nullptr) kept.push_back(std::move(item));
    }
    return kept;
  }

 private:
  [[noreturn]] static void fail(const std::string& what) { throw CLI::ConfigError("the configuration file: " + what); }

  static void check_lines(const std::string& text) {
    std::istringstream lines(text);
    std::size_t number = 0;
    int open_brackets = 0;
    for (std::string line; std::getline(lines, line);) {
      ++number;
      const auto start = line.find_first_not_of(" \t\r");
      const bool says_nothing = start == std::string::npos || line[start] == '#' || line[start] == ';';
      if (says_nothing) continue;
      const bool inside = open_brackets > 0, table = line[start] == '[';
      const auto equals = line.find('=');
      if (!inside && !table && (equals == std::string::npos || equals == start)) {
        fail("line " + std::to_string(number) +
             " is neither a table like [serve] nor 'key = value': " + line.substr(start));
      }
      if (table && !inside) continue;
      open_brackets +=
          static_cast<int>(std::count(line.begin(), line.end(), '[') - std::count(line.begin(), line.end(), ']'));
    }
  }

  const CLI::App& check_table(const std::vector<std::string>& parents) const {
    const CLI::App* app = &app_;
    for (const auto& parent : parents) {
      const auto commands =
          app->get_subcommands([&](const CLI::App* command) { return command->get_name() == parent; });
      if (commands.empty()) fail("the table [" + parent + "] is unknown, expected [serve] or [worker]");
      app = commands.front();
    }
    return *app;
  }

  const CLI::Option& option_of(const CLI::ConfigItem& item) const {
    const CLI::App& app = check_table(item.parents);
    const CLI::Option* option = item.parents.empty() ? nullptr : app.get_option_no_throw("--" + item.name);
    if (option == nullptr) {
      fail("the key '" + item.name + "' is unknown" +
           (item.parents.empty() ? " outside of the tables [serve] and [worker]"
                                 : " in [" + item.parents.front() + "]"));
    }
    return *option;
  }

  const CLI::App& app_;
};

bool is_loopback(const std::string& host) { return host == "localhost" || host == "::1" || host.rfind("127.", 0) == 0; }

std::string access_refusal(const ServeConfig& config) {
  const AccessConfig& access = config.access;
  if (!access.keys.empty() && access.open) return "--keys and --open exclude each other";
  if (!is_loopback(config.host) && access.keys.empty() && !access.open) {
    return "listening on " + config.host +
           " lets anyone who can reach it use the service; give --keys FILE, or --open to allow that, or listen on "
           "127.0.0.1";
  }
  for (const auto& origin : access.cors_origins) {
    if (origin == "*" ? !access.open : !is_origin(origin)) {
      return "--cors-origin " + origin + " is not an origin like https://example.org, nor * with --open";
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

void use_allowance(ServeConfig& config, const Allowance& allowed) {
  config.threads = usable_processors(allowed, std::max(1U, std::thread::hardware_concurrency()));
  config.workers = affordable_processes(allowed, config.threads / 2, kUsefulJobMb);
  config.job.memory_mb = memory_per_job_mb(allowed, config.workers, config.job.memory_mb);
}

void use_allowance(WorkerConfig& config, const Allowance& allowed) {
  config.job.memory_mb = memory_per_job_mb(allowed, 1, config.job.memory_mb);
}

void add_serve_options(CLI::App& command, ServeConfig& config) {
  use_allowance(config);
  add(command, "--host", config.host, "Address to listen on");
  add(command, "--port", config.port, "Port to listen on; 0 takes any free one")->check(CLI::Range(0, 65'535));
  add_path(command, "--port-file", config.port_file, "File to write the port to once the server listens");
  add(command, "--base-path", config.base_path,
      "Path below which clients find the service, such as /meshes; a trusted proxy may name another in "
      "X-Forwarded-Prefix");
  add_path(command, "--page-dir", config.page_dir,
           "Folder of the web page; by default the one that is installed with this binary");
  add_store_options(command, config.store);
  add(command, "--orphans", config.store.orphans,
      "When the database is missing beside files of jobs: refuse to start, adopt the jobs, or discard their files")
      ->check(CLI::IsMember({"refuse", "adopt", "discard"}));
  add(command, "--workers", config.workers, "Number of worker processes; by default one for every two processors")
      ->check(CLI::Range(0UL, 1'024UL));
  add(command, "--threads", config.threads,
      "Threads of a job that asks for none; by default as many as there are processors")
      ->check(CLI::Range(1UL, 256UL));
  add_log_options(command, config.log);
  command.option_defaults()->group("Access");
  add_access_options(command, config.access);
  command.option_defaults()->group("Limits");
  add_service_limits(command, config);
  add_limit_options(command, config.limits);
  add_job_options(command, config.job);
  add_timeouts(command, config);
}

void add_worker_options(CLI::App& command, WorkerConfig& config) {
  use_allowance(config);
  add(command, "--name", config.name, "Name of this worker in the job store; by default host and process id");
  add_store_options(command, config.store);
  add_limit_options(command, config.limits);
  add_job_options(command, config.job);
  add_log_options(command, config.log);
}

void add_key_options(CLI::App& command, KeyConfig& config) {
  command.add_option("name", config.name, "Name of the key's owner, 1 to 100 bytes")
      ->required()
      ->check([](const std::string& name) {
        return name.empty() || name.size() > kMaxKeyNameBytes ? "the name must have 1 to 100 bytes" : "";
      });
  add_path(command, "--keys", config.keys, "File to add the entry to; without it, the entry is printed");
}

void prefer_keys(AccessConfig& access) {
  if (!access.keys.empty() && std::getenv("CREASED_OPEN") != nullptr) access.open = false;
}

std::shared_ptr<CLI::Config> strict_config(const CLI::App& app) { return std::make_shared<StrictConfig>(app); }

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
  if (std::string reason = access_refusal(config); !reason.empty()) return reason;
  if (!config.base_path.empty() && !is_path_prefix(config.base_path)) {
    return "--base-path " + config.base_path + " is not a path like /meshes, without a slash at its end";
  }
  if (is_postgresql(config.store.url) && config.store.orphans != "refuse") {
    return "--orphans " + config.store.orphans + " is for a store in files; PostgreSQL keeps rows and files together";
  }
  if (config.retention_hours > config.max_retention_hours) {
    return "--retention-hours must not exceed --max-retention-hours";
  }
  if (config.max_streams >= config.max_connections) {
    return "--max-streams must be less than --max-connections, so that event streams cannot block all other calls";
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
  options.orphans = config.orphans == "adopt"     ? Orphans::kAdopt
                    : config.orphans == "discard" ? Orphans::kDiscard
                                                  : Orphans::kRefuse;
  return options;
}

std::vector<std::string> worker_arguments(const ServeConfig& config) {
  return {"worker",
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
