#include "server/serve.h"

#include <pthread.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstring>
#include <fstream>
#include <future>
#include <system_error>
#include <thread>

#include "server/api/api.h"
#include "server/base/log.h"
#include "server/store/health.h"
#include "server/store/housekeeper.h"
#include "server/worker/supervisor.h"
#include "server/worker/worker.h"

namespace creased {
namespace code = crease::code;
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kPoll{20};
constexpr milliseconds kHousekeeping{1'000};
constexpr milliseconds kDrainGrace{2'000};
constexpr milliseconds kLastGrace{3'000};
constexpr double kWorkerGraceSeconds = 4;

GuardedServer::Options server_options(const ServeConfig& config) {
  GuardedServer::Options options;
  options.stream.head_timeout = milliseconds_of(config.head_timeout);
  options.stream.body_timeout = milliseconds_of(config.body_timeout);
  options.stream.idle_timeout = milliseconds_of(config.idle_timeout);
  options.max_connections = config.max_connections;
  options.max_connections_per_address = config.access.max_connections_per_address;
  options.trusted_proxies = AddressList(config.access.trusted_proxies);
  options.base_path = config.base_path;
  return options;
}

Inspector::Options inspector_options(const ServeConfig& config) {
  Inspector::Options options;
  options.max_vertices = config.limits.max_vertices;
  options.max_faces = config.limits.max_faces;
  options.memory_limit_mb = config.job.memory_mb;
  return options;
}

/// Raises the limit of open files to its maximum: every connection needs one descriptor, and every download another.
void raise_file_limit() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

/// Links must work on every server of a shared store.
LinkSigner link_signer(const ServeConfig& config, Store& store) {
  if (!store.is_shared()) return LinkSigner::of_folder(config.store.data_dir);
  return LinkSigner(store.link_secret(LinkSigner::fresh_secret()));
}

/// A server begins with a check of the store; its workers rely on that.
StoreOptions recovering(StoreOptions options) {
  options.recover = true;
  return options;
}

/// \throw crease::Error process_unavailable when there are fewer files to open than the connections need
void check_file_limit(const ServeConfig& config) {
  constexpr std::size_t kPerConnection = 2, kSpare = 128;  // the connection, and the file that it downloads
  rlimit limit{};
  const std::size_t needed = config.max_connections * kPerConnection + kSpare;
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= needed) return;
  throw crease::Error(code::kProcessUnavailable,
                      fmt::format("{} connections need {} open files, but the limit is {}; raise it (ulimit -n {}) or "
                                  "lower --max-connections",
                                  config.max_connections, needed, limit.rlim_cur, needed));
}

void write_port_file(const std::filesystem::path& path, int port) {
  auto partial = path;
  partial += ".part";
  std::ofstream file(partial);
  file << port << '\n';
  file.close();
  if (!file) throw std::system_error(std::make_error_code(std::errc::io_error), "cannot write " + path.string());
  std::filesystem::rename(partial, path);
}

sigset_t awaited_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGHUP);
  return signals;
}

crease::OperatorSettings parameter_settings(const ServeConfig& config) {
  crease::OperatorSettings settings;
  settings.defaults.set_retention_hours(config.retention_hours);
  settings.maxima.set_retention_hours(config.max_retention_hours);
  return settings;
}

/// The running service: server, job watcher and workers. run() ends them in an order that loses nothing.
class Service {
 public:
  Service(const ServeConfig& config, const std::filesystem::path& executable)
      : gate_(gatekeeper_options(config)),
        store_(open_store(recovering(store_options(config.store)))),
        links_(link_signer(config, *store_)),
        health_(*store_, config.workers > 0),
        tasks_({.executable = executable}),
        inspector_(tasks_, inspector_options(config)),
        encoder_(tasks_, {.memory_limit_mb = config.job.memory_mb}),
        results_(*store_, encoder_),
        streams_(config.max_streams),
        page_(config.page_dir.empty() ? PageFiles::installed_folder(executable) : config.page_dir),
        watcher_(*store_, kPoll,
                 {.changed = [this](const JobChange& change) { metrics_.count_state(change.job_id, change.state); },
                  .removed = [this](const std::string& id) { metrics_.forget(id); }}),
        api_({.store = *store_,
              .inspector = inspector_,
              .results = results_,
              .watcher = watcher_,
              .metrics = metrics_,
              .gate = gate_,
              .links = links_,
              .streams = streams_,
              .page = page_,
              .shutting_down = shutting_down_,
              .cors = CorsPolicy(config.access.cors_origins),
              .parameters = parameter_settings(config),
              .threads = static_cast<std::uint32_t>(config.threads),
              .job_memory_bytes = std::uint64_t{config.job.memory_mb} << 20U,
              .not_ready = [this] { return health_.reason(); }}),
        housekeeper_(*store_, kHousekeeping,
                     [this](const std::string& id) {
                       watcher_.refresh(id);
                       metrics_.forget(id);
                     }),
        server_(server_options(config), api_.hooks()) {
    tasks_.await_start();
    cancel_jobs_of_revoked_keys();
    api_.attach(server_);
    server_.take_threads();
    port_ = server_.bind(config.host, config.port);
    if (config.workers > 0) {
      free_claims_of_the_dead();
      workers_ = std::make_unique<Supervisor>(
          Supervisor::Options{executable, worker_arguments(config), config.workers,
                              [this](int process, const std::string& what) { worker_ended(process, what); }});
    }
  }

  int port() const { return port_; }

  /// Returns the exit code.
  int run() {
    auto served = std::async(std::launch::async, [this] {
      const bool ended_well = server_.serve();
      ::kill(::getpid(), SIGTERM);  // wakes the wait below if nobody else did
      return ended_well;
    });
    return drain(served, await_end());
  }

 private:
  /// Frees jobs that are still claimed by workers of an earlier server that was killed.
  void free_claims_of_the_dead() {
    for (const std::string& worker : store_->busy_workers()) {
      if (is_dead_worker(worker, store_->is_shared()))
        store_->lose_all(worker, {.what = "ended with its server", .with_server = true});
    }
  }

  /// Frees the jobs that the worker had claimed at once, without waiting for their leases.
  void worker_ended(int process, const std::string& what) {
    try {
      store_->lose_all(worker_name(process, store_->is_shared()), {.what = "ended because its worker " + what});
    } catch (const crease::Error& error) {
      spdlog::warn("the jobs of worker process {} stay claimed until their leases end: {}", process, error.detail());
    }
  }

  void cancel_jobs_of_revoked_keys() {
    if (!gate_.keyed()) return;
    for (const std::string& owner : store_->busy_owners()) {
      if (owner.empty() || gate_.knows(owner)) continue;
      log_event(spdlog::level::info, "the key is revoked, its jobs are cancelled", {{"key", owner}});
      store_->cancel_all(owner);
    }
  }

  /// Waits for the signal that ends the service. SIGHUP reloads the keys; a service without keys has none to reload and
  /// ends, as its terminal has closed.
  int await_end() {
    const sigset_t signals = awaited_signals();
    constexpr timespec kLook{.tv_sec = 1, .tv_nsec = 0};
    for (;;) {
      const int signal = ::sigtimedwait(&signals, nullptr, &kLook);
      if (signal > 0 && (signal != SIGHUP || !reload())) return signal;
      api_.log_refusals();
    }
  }

  bool reload() {
    if (!gate_.keyed()) return false;
    try {
      gate_.reload();
      cancel_jobs_of_revoked_keys();
    } catch (const std::exception& error) {
      log_event(spdlog::level::err, "keys not reloaded, the previous ones stay in use", {{"what", error.what()}});
    }
    return true;
  }

  int drain(std::future<bool>& served, int signal) {
    log_event(spdlog::level::info, "draining", {{"signal", ::sigdescr_np(signal)}});
    shutting_down_ = true;
    watcher_.close();
    auto stopped = std::async(std::launch::async, [this] {
      if (workers_ != nullptr) workers_->stop(kWorkerGraceSeconds);
    });
    server_.drain(kDrainGrace);
    stopped.wait();
    if (served.wait_for(kLastGrace) != std::future_status::ready) {
      // A request is stuck, for example in the inspection of an upload. The store is safe to leave at any time.
      spdlog::warn("stopped while requests were still running");
      std::_Exit(0);
    }
    spdlog::info("stopped");
    return served.get() ? 0 : 1;
  }

  std::atomic<bool> shutting_down_{false};
  Gatekeeper gate_;
  std::unique_ptr<Store> store_;
  LinkSigner links_;
  Health health_;
  Metrics metrics_;
  TaskPool tasks_;
  Inspector inspector_;
  Encoder encoder_;
  ResultFiles results_;
  OpenStreams streams_;
  PageFiles page_;
  JobWatcher watcher_;
  Api api_;
  Housekeeper housekeeper_;
  GuardedServer server_;
  std::unique_ptr<Supervisor> workers_;
  int port_ = 0;
};

}  // namespace

int serve(const ServeConfig& config, const std::filesystem::path& executable) {
  raise_file_limit();
  try {
    check_file_limit(config);
    Service service(config, executable);
    if (!config.port_file.empty()) write_port_file(config.port_file, service.port());
    log_event(spdlog::level::info, "listening",
              {{"host", config.host}, {"port", service.port()}, {"version", CREASE_VERSION}});
    return service.run();
  } catch (const KeyFileError& error) {
    spdlog::critical("cannot start with the key file {}: {}", config.access.keys.string(), error.what());
  } catch (const crease::Error& error) {
    spdlog::critical("cannot start: {}", error.detail());
  } catch (const std::bad_alloc&) {
    spdlog::critical("cannot start: there is not enough memory; raise its limit (ulimit -v, or that of the container)");
  } catch (const std::system_error& error) {
    const bool of_threads = error.code() == std::errc::resource_unavailable_try_again;
    if (of_threads) {
      spdlog::critical(
          "cannot start: a thread could not be started ({}); raise the limit of processes or memory (ulimit -u, ulimit "
          "-v)",
          error.what());
    } else {
      spdlog::critical("cannot listen on {} port {}: {}", config.host, config.port, error.what());
    }
  } catch (const std::exception& error) {
    spdlog::critical("cannot start: {}", error.what());
  }
  return 1;
}

}  // namespace creased
