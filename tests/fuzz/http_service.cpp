#include "tests/fuzz/http_service.h"

#include <spdlog/sinks/null_sink.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <fstream>
#include <stdexcept>

#include "core/job.h"
#include "crease/v1/result.pb.h"
#include "proto/convert.h"
#include "proto/parameter_table.h"
#include "server/api/api.h"
#include "tests/support/meshes.h"
#include "tests/support/server_process.h"
#include "tests/support/store_support.h"

namespace crease::fuzz {
namespace {

using std::chrono::milliseconds;

constexpr std::chrono::hours kNever{1};

creased::StoreOptions store_options(const test::TemporaryFolder& folder) {
  creased::StoreOptions options;
  options.data_dir = folder.path() / "data";
  return options;
}

creased::GuardedServer::Options server_options() {
  creased::GuardedServer::Options options;
  options.stream.write_timeout =
      milliseconds(1);  // the client reads only at the end, so answers that do not fit the socket's buffer are cut off
  return options;
}

/// A pool without a program: it refuses every complete upload and every encoding.
creased::TaskPool::Options no_processes() { return {.executable = "/nonexistent"}; }

/// A service without keys that accepts small uploads.
creased::Gatekeeper::Options open_gate() {
  creased::Gatekeeper::Options options;
  options.open.max_upload_mb = 1;
  return options;
}

OperatorSettings settings() {
  OperatorSettings settings;
  settings.defaults.set_retention_hours(24);
  settings.maxima.set_retention_hours(720);
  return settings;
}

class Service {
 public:
  Service()
      : gate_(open_gate()),
        store_(creased::open_store(store_options(folder_))),
        tasks_(no_processes()),
        inspector_(tasks_, {}),
        encoder_(tasks_, {}),
        results_(*store_, encoder_),
        streams_(4),
        page_({}),
        watcher_(*store_, kNever, {.changed = [](const auto&) {}, .removed = [](const auto&) {}}),
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
              .cors = creased::CorsPolicy({"https://app.example"}),
              .parameters = settings()}),
        server_(server_options(), hooks()) {
    api_.attach(server_);
    server_.bind("127.0.0.1", 0);  // never used, but the library considers a server without a socket stopped
  }

  Conversation converse(std::string_view bytes) {
    keep_the_finished_job();
    conversation_ = {};
    std::array<int, 2> ends{};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) throw std::runtime_error("no sockets");
    send_all(ends[0], bytes);
    server_.process_and_close_socket(ends[1]);
    conversation_.answers = receive_all(ends[0]);
    ::close(ends[0]);
    return std::move(conversation_);
  }

 private:
  creased::GuardedServer::Hooks hooks() {
    auto hooks = api_.hooks();
    hooks.finished = [this, finished = hooks.finished](const creased::ExchangeSummary& exchange) {
      conversation_.exchanges.push_back(exchange);
      finished(exchange);
    };
    return hooks;
  }

  static void send_all(int socket, std::string_view bytes) {
    if (::send(socket, bytes.data(), bytes.size(), MSG_DONTWAIT) != static_cast<ssize_t>(bytes.size())) {
      throw std::length_error("more than a socket holds");
    }
    ::shutdown(socket, SHUT_WR);
  }

  static std::string receive_all(int socket) {
    std::string all;
    std::array<char, 65536> piece;
    for (ssize_t count = 1; count > 0;
         all.append(piece.data(), static_cast<std::size_t>(std::max<ssize_t>(count, 0)))) {
      count = ::recv(socket, piece.data(), piece.size(), 0);
    }
    return all;
  }

  void keep_the_finished_job() {
    if (store_->find(kFinishedJob)) return;
    bool created = false;
    const std::string upload = test::obj_text(test::cube(1));
    const v1::Job job = store_->submit(test::new_job(*store_, std::string(kFinishedJob), upload), created);
    const creased::Claim claim = store_->claim("fuzz", kNever).value();
    static const JobOutput output = made(upload, job.parameters());
    write(creased::file::kResult, to_message(output.result));
    v1::Report report;
    report.set_id(job.id());
    *report.mutable_result() = to_message(output.facts);
    write(creased::file::kReport, report);
    store_->succeed(claim, report.result(), {});
  }

  static JobOutput made(const std::string& upload, const v1::Parameters& parameters) {
    SmoothOptions options = to_options(parameters);
    std::get<MrfOptions>(options.method).sweeps = 2;
    RunContext context;
    return run_job(check_input(upload, MeshFormat::kObj), options, context);
  }

  void write(std::string_view name, const google::protobuf::Message& message) {
    std::ofstream file(folder_.path() / "data" / "jobs" / kFinishedJob / name, std::ios::binary);
    if (!message.SerializeToOstream(&file)) throw std::runtime_error("the finished job cannot be written");
  }

  const test::TemporaryFolder folder_;
  const std::atomic<bool> shutting_down_{false};
  creased::Gatekeeper gate_;
  const creased::LinkSigner links_{"a secret of the tests"};
  std::unique_ptr<creased::Store> store_;
  creased::Metrics metrics_;
  creased::TaskPool tasks_;
  creased::Inspector inspector_;
  creased::Encoder encoder_;
  creased::ResultFiles results_;
  creased::OpenStreams streams_;
  creased::PageFiles page_;
  creased::JobWatcher watcher_;
  creased::Api api_;
  creased::GuardedServer server_;
  Conversation conversation_;
};

/// The service, which exists until the process ends. Its log is formatted and then discarded.
Service& service() {
  static Service service = [] {
    spdlog::set_default_logger(spdlog::null_logger_mt("fuzz"));
    return Service();
  }();
  return service;
}

}  // namespace

Conversation converse(std::string_view bytes) { return service().converse(bytes); }

}  // namespace crease::fuzz
