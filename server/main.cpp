#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>

#include "core/error.h"
#include "server/api/openapi.h"
#include "server/base/log.h"
#include "server/config.h"
#include "server/serve.h"
#include "server/store/store.h"
#include "server/worker/sandbox.h"
#include "server/worker/worker.h"
#ifdef CREASED_POSTGRESQL
#include "server/postgresql/postgresql_store.h"
#endif

namespace {

constexpr int kUsageError = 2;
#ifdef CREASED_POSTGRESQL
constexpr bool kHasPostgresql = true;
#else
constexpr bool kHasPostgresql = false;
#endif

std::atomic<bool> stop_worker{false};

void mask_signals(int how, std::initializer_list<int> numbers) {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int number : numbers) sigaddset(&signals, number);
  pthread_sigmask(how, &signals, nullptr);
}

/// Becomes the program beside this one that links the client of PostgreSQL, when the store needs it and this one does
/// not.
void find_store(const creased::StoreConfig& config, char** arguments) {
  if (kHasPostgresql || !creased::is_postgresql(config.url)) return;
  const auto program = std::filesystem::read_symlink("/proc/self/exe").replace_filename("creased-postgresql");
  ::execv(program.c_str(), arguments);
  throw std::runtime_error(fmt::format("a store in PostgreSQL needs {}: {}", program.string(), std::strerror(errno)));
}

int run_serve(creased::ServeConfig& config) {
  creased::prefer_keys(config.access);
  if (const std::string reason = creased::refusal(config); !reason.empty()) {
    spdlog::critical("{}", reason);
    return kUsageError;
  }
  // For the workers. Unlike arguments, which anyone can see, it may have a password.
  ::setenv("CREASED_STORE", config.store.url.c_str(), 1);
  mask_signals(SIG_BLOCK, {SIGTERM, SIGINT, SIGHUP});
  return creased::serve(config, std::filesystem::read_symlink("/proc/self/exe"));
}

int run_worker(const creased::WorkerConfig& config) {
  std::signal(SIGTERM, [](int) { stop_worker = true; });
  std::signal(SIGINT, [](int) { stop_worker = true; });
  mask_signals(SIG_UNBLOCK, {SIGTERM, SIGINT});
  auto options = creased::worker_options(config);
  options.executable = std::filesystem::read_symlink("/proc/self/exe");
  const auto store = creased::open_store(creased::store_options(config.store));
  if (options.name.empty()) options.name = creased::worker_name(::getpid(), store->is_shared());
  return creased::run_worker(*store, options, stop_worker);
}

int run_compute() {
  std::signal(SIGINT, SIG_IGN);  // Ctrl-C reaches the whole process group; this process ends with its input
  mask_signals(SIG_UNBLOCK, {SIGTERM, SIGINT});
  return creased::run_compute();
}

int run_key(const creased::KeyConfig& config) {
  const creased::NewKey key = creased::make_key(config.name);
  if (config.keys.empty()) {
    fmt::print("{}\n{}\n", key.text, key.entry.dump());
  } else {
    creased::add_key(config.keys, key.entry);
    fmt::print("{}\n", key.text);
  }
  return 0;
}

int run_openapi() {
  fmt::print("{}\n", creased::openapi_document({}).dump(2));
  return 0;
}

template <typename Run>
int guarded(const creased::LogConfig& log, const Run& run) {
  creased::configure_log(log.format, log.level);
  try {
    return run();
  } catch (const std::exception& error) {
    spdlog::critical("{}", error.what());
    return 1;
  }
}

int run(int argc, char** argv) {
  ::umask(S_IRWXG | S_IRWXO);  // nothing that this program makes is for others
  CLI::App app("creased removes noise from triangle meshes over HTTP, keeps their ridges, and labels them.");
  app.set_version_flag("--version", CREASE_VERSION);
  app.set_config("--config", "", "TOML or INI file with options in the section [serve] or [worker]");
  app.config_formatter(creased::strict_config(app));
  app.require_subcommand(1);
  creased::ServeConfig serve;
  creased::WorkerConfig worker;
  creased::KeyConfig key;
  const std::string order =
      "Options can also be set in the file of --config (section [serve] or [worker]) or in the environment. "
      "A flag overrides the environment, and the environment overrides the file.";
  auto* serve_command = app.add_subcommand("serve", "Run the HTTP service and its worker processes")->fallthrough();
  auto* worker_command = app.add_subcommand("worker", "Run jobs from a store, without HTTP")->fallthrough();
  app.add_subcommand("compute",
                     "Internal: checks and smooths meshes in confined processes; started by servers and workers");
  creased::add_serve_options(*serve_command->footer(order), serve);
  creased::add_worker_options(*worker_command->footer(order), worker);
  auto* key_command = app.add_subcommand(
      "key", "Make an API key. Prints it, and prints its entry for the key file or adds the entry to --keys");
  creased::add_key_options(*key_command, key);
  auto* openapi_command = app.add_subcommand("openapi", "Print the OpenAPI document");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kUsageError;
  }
  if (serve_command->parsed()) {
    return guarded(serve.log, [&] {
      find_store(serve.store, argv);
      return run_serve(serve);
    });
  }
  if (worker_command->parsed()) {
    return guarded(worker.log, [&] {
      find_store(worker.store, argv);
      return run_worker(worker);
    });
  }
  if (key_command->parsed()) return run_key(key);
  if (openapi_command->parsed()) return run_openapi();
  return run_compute();
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGXFSZ, SIG_IGN);  // a limit on files makes a write fail, and does not end the process
#ifdef CREASED_POSTGRESQL
  creased::enable_postgresql(creased::open_postgresql_store);
#endif
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "creased: %s\n", error.what());
    return 1;
  }
}
