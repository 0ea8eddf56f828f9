// Load on a store that many servers and workers share, on a PostgreSQL of its own that syncs its disk:
//   shared_load [claims | changes | events | idle | storage | million JOBS]…
// Prints figures. Without a step all of them run, the last with a million jobs.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <barrier>
#include <chrono>
#include <fstream>
#include <future>
#include <map>
#include <mutex>
#include <pqxx/pqxx>
#include <string>
#include <thread>
#include <vector>

#include "server/base/log.h"
#include "server/postgresql/postgresql_store.h"
#include "tests/support/filled_store.h"
#include "tests/support/meshes.h"
#include "tests/support/postgresql_server.h"
#include "tests/support/server_process.h"
#include "tests/support/store_support.h"

namespace crease::test {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;
using std::chrono::milliseconds;
namespace file = creased::file;

constexpr std::chrono::hours kLease{1};

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

template <class Call>
auto timed(std::vector<double>& times, const Call& call) {
  const auto start = Clock::now();
  auto result = call();
  times.push_back(ms_since(start));
  return result;
}

/// "median 1.2 ms, 99 % below 3.4 ms, longest 5.6 ms".
std::string spread(std::vector<double> times) {
  if (times.empty()) return "nothing measured";
  std::ranges::sort(times);
  constexpr double kMost = 0.99;
  const auto most = static_cast<std::size_t>(kMost * static_cast<double>(times.size() - 1));
  return fmt::format("median {:.1f} ms, 99 % below {:.1f} ms, longest {:.1f} ms", times[times.size() / 2], times[most],
                     times.back());
}

void append(std::vector<double>& all, const std::vector<double>& some) {
  all.insert(all.end(), some.begin(), some.end());
}

class Load {
 public:
  void claims();
  void changes();
  void events();
  void idle();
  void storage();
  void million(std::int64_t jobs);

 private:
  std::unique_ptr<creased::Store> open(const std::string& url) {
    return creased::open_postgresql_store(
        {.url = url, .data_dir = folder_.path() / fmt::format("store{}", ++folders_), .max_queued = 1'000'000});
  }
  std::unique_ptr<ServerProcess> new_server(const std::string& url) const {
    return std::make_unique<ServerProcess>(std::vector<std::string>{
        "--store", url, "--workers", "0", "--max-connections", "64", "--max-streams", "8", "--log-level", "error"});
  }
  std::unique_ptr<Program> new_worker(const std::string& url) {
    const auto folder = folder_.path() / fmt::format("worker{}", ++folders_);
    return std::make_unique<Program>(
        std::vector<std::string>{CREASED_BIN, "worker", "--store", url, "--data-dir", folder, "--log-level", "error"});
  }
  std::string value(const std::string& url, const std::string& sql) const {
    pqxx::connection connection(url);
    return pqxx::nontransaction(connection).exec1(sql)[0].as<std::string>("");
  }
  void run(const std::string& url, const std::string& sql) const {
    pqxx::connection connection(url);
    pqxx::nontransaction(connection).exec(sql);
  }
  std::vector<double> submit(creased::Store& store, int jobs) const;
  std::string end_all(const std::string& url, int workers, int jobs);
  double changes_a_second(const std::string& url, int workers, Seconds time);
  std::string sizes(const std::string& url, std::int64_t jobs) const;
  void list_pages(const std::string& url) const;
  void expire(const std::string& url, std::int64_t jobs);

  PostgresqlServer database_{{.synced = true}};
  const TemporaryFolder folder_;
  std::atomic<int> folders_{0};
};

std::vector<double> Load::submit(creased::Store& store, int jobs) const {
  static const std::string upload = obj_text(cube(2));
  std::vector<double> times;
  bool created = false;
  for (int i = 0; i < jobs; ++i) {
    auto job = new_job(store, "0123456789abcdef", upload);
    job.input.set_faces(48);
    timed(times, [&] { return store.submit(job, created); });
  }
  return times;
}

/// Ends jobs in as many stores, each with connections of its own and in a thread of its own, as fast as it goes.
std::string Load::end_all(const std::string& url, int workers, int jobs) {
  std::atomic<int> left = jobs;
  std::mutex mutex;
  std::vector<double> claiming, ending;
  std::barrier ready(workers + 1);
  std::vector<std::jthread> threads;
  for (int worker = 0; worker < workers; ++worker) {
    threads.emplace_back([&, name = fmt::format("worker{}", worker)] {
      const auto store = open(url);
      std::vector<double> own_claiming, own_ending;
      const std::string result(3'000, 'r'), report(1'000, 'p');
      ready.arrive_and_wait();
      while (left > 0) {
        const auto start = Clock::now();
        const auto claim = store->claim(name, kLease);
        if (!claim) {
          std::this_thread::sleep_for(milliseconds(1));
          continue;
        }
        own_claiming.push_back(ms_since(start));
        --left;
        std::ofstream(store->working_path(*claim, file::kResult)) << result;
        std::ofstream(store->working_path(*claim, file::kReport)) << report;
        timed(own_ending, [&] {
          return store->succeed(*claim, {}, {},
                                {{std::string(file::kResult), result.size(), "hash"},
                                 {std::string(file::kReport), report.size(), "hash"}});
        });
      }
      const std::lock_guard lock(mutex);
      append(claiming, own_claiming);
      append(ending, own_ending);
    });
  }
  ready.arrive_and_wait();
  const auto start = Clock::now();
  threads.clear();
  return fmt::format("{:.0f} jobs/s claimed and ended; claim {}; end {}", jobs * 1000.0 / ms_since(start),
                     spread(claiming), spread(ending));
}

void Load::claims() {
  constexpr int kJobs = 2'000;
  for (const auto& [workers, queued] : {std::pair(1, kJobs), {4, kJobs}, {64, kJobs}, {4, 5 * kJobs}}) {
    const std::string url = database_.create_database();
    const auto submitting = submit(*open(url), queued);
    fmt::print("{} jobs queued: submit {}\n", queued, spread(submitting));
    run(url, "VACUUM ANALYZE");
    fmt::print("{} workers, {} of {} jobs: {}\n", workers, kJobs, queued, end_all(url, workers, kJobs));
  }
}

/// Publishes progress in as many stores as fast as it goes.
double Load::changes_a_second(const std::string& url, int workers, Seconds time) {
  std::atomic<int> changes = 0;
  std::barrier ready(workers);
  const auto work = [&](int worker) {
    const auto store = open(url);
    const auto claim = store->claim(fmt::format("worker{}", worker), kLease);
    v1::Progress progress;
    ready.arrive_and_wait();
    const auto end = Clock::now() + time;
    while (claim && Clock::now() < end) {
      progress.set_sweep(progress.sweep() + 1);
      store->publish_progress(*claim, progress);
      ++changes;
    }
    if (claim) store->put_back(*claim);
  };
  {
    std::vector<std::jthread> threads;
    for (int worker = 0; worker < workers; ++worker) threads.emplace_back(work, worker);
  }
  return changes / time.count();
}

void Load::changes() {
  constexpr Seconds kTime{5};
  const std::string url = database_.create_database();
  submit(*open(url), 64);
  for (const int workers : {1, 4, 64}) {
    fmt::print("{} workers: {:.0f} changes/s\n", workers, changes_a_second(url, workers, kTime));
  }
  {
    const auto one = new_server(url), other = new_server(url);
    fmt::print("4 workers and two servers that follow: {:.0f} changes/s\n", changes_a_second(url, 4, kTime));
  }
  pqxx::connection backup(url);
  pqxx::transaction<pqxx::repeatable_read> view(backup);
  view.exec("SELECT count(*) FROM jobs");
  for (int round = 1; round <= 4; ++round) {
    fmt::print("4 workers beside a view that is held, as a backup has, round {}: {:.0f} changes/s\n", round,
               changes_a_second(url, 4, kTime));
  }
}

void Load::events() {
  constexpr int kSamples = 200;
  const std::string url = database_.create_database();
  const auto one = new_server(url), other = new_server(url);
  for (const auto* const told : {one.get(), other.get()}) {
    std::vector<double> times, calls;
    for (int sample = 0; sample < kSamples; ++sample) {
      const std::string id = one->submit(obj_text(cube(2)), fmt::format("seed={}", sample))["id"];
      RawConnection stream(told->port());
      stream.send(raw_request("GET", "/v1/jobs/" + id + "/events"));
      stream.receive_until("\"queued\"");
      const auto start = Clock::now();
      auto heard = std::async(std::launch::async, [&] {
        stream.receive_until("\"cancelled\"");
        return ms_since(start);
      });
      exchange(one->port(), "POST", "/v1/jobs/" + id + "/cancel");
      calls.push_back(ms_since(start));
      times.push_back(heard.get());
    }
    fmt::print("from a call to its event on {} server: {}; the call itself {}\n",
               told == one.get() ? "the same" : "another", spread(times), spread(calls));
  }
}

void Load::idle() {
  const std::string url = database_.create_database();
  const auto server = new_server(url);
  const auto worker = new_worker(url);
  server->wait_for_end(server->submit(obj_text(cube(2)), "sweeps=1")["id"]);
  for (const auto& [pause, samples] : {std::pair(milliseconds(500), 30), std::pair(milliseconds(12'000), 5)}) {
    std::vector<double> times;
    for (int sample = 0; sample < samples; ++sample) {
      std::this_thread::sleep_for(pause);
      const std::string id =
          server->submit(obj_text(cube(2)), fmt::format("sweeps=1&seed={}", pause.count() + sample))["id"];
      server->wait_for_end(id);
      times.push_back(std::stod(value(url, "SELECT started - created FROM jobs WHERE id = '" + id + "'")));
    }
    fmt::print("from submission to claim after {} ms of idling: {}\n", pause.count(), spread(times));
  }
  const auto transactions = [&] {
    return std::stod(
        value(url, "SELECT xact_commit + xact_rollback FROM pg_stat_database WHERE datname = current_database()"));
  };
  constexpr std::chrono::seconds kIdle{20};
  const double before = transactions();
  std::this_thread::sleep_for(kIdle);
  fmt::print("an idle server and an idle worker: {:.1f} transactions/s\n", (transactions() - before) / kIdle.count());
}

/// The size of each table with its indexes, in bytes for each job.
std::string Load::sizes(const std::string& url, std::int64_t jobs) const {
  run(url, "VACUUM");
  std::string text;
  std::int64_t sum = 0;
  for (const std::string table : {"jobs", "files", "chunks", "removed", "usage"}) {
    const auto bytes = std::stoll(value(url, "SELECT pg_total_relation_size('" + table + "')"));
    sum += bytes;
    text += fmt::format(", {} {}", table, bytes / jobs);
  }
  return fmt::format("{} bytes for each job{}", sum / jobs, text);
}

void Load::storage() {
  constexpr int kJobs = 500;
  const std::string url = database_.create_database();
  const auto server = new_server(url);
  const std::string upload = obj_text(cube(2));
  for (int seed = 0; seed < kJobs; ++seed) server->submit(upload, fmt::format("sweeps=1&threads=1&seed={}", seed));
  fmt::print("{} jobs with an upload of {} bytes, queued: {}\n", kJobs, upload.size(), sizes(url, kJobs));
  {
    const auto one = new_worker(url), other = new_worker(url);
    while (value(url, "SELECT count(*) FROM jobs WHERE state = 'succeeded'") != std::to_string(kJobs)) {
      std::this_thread::sleep_for(milliseconds(100));
    }
  }
  fmt::print("done, with files of {} bytes: {}\n", value(url, "SELECT sum(bytes) / count(DISTINCT job) FROM files"),
             sizes(url, kJobs));
  run(url, "UPDATE jobs SET expires = now_ms()");
  while (value(url, "SELECT count(*) FROM chunks") != "0") {
    server->submit(upload, "sweeps=1");
    std::this_thread::sleep_for(milliseconds(100));
    run(url, "UPDATE jobs SET expires = now_ms() WHERE state = 'succeeded'; DELETE FROM jobs WHERE state = 'queued'");
  }
  fmt::print("expired: {}\n", sizes(url, kJobs));
}

void Load::list_pages(const std::string& url) const {
  const auto starting = Clock::now();
  const auto server = new_server(url);
  fmt::print("a server starts in {:.0f} ms\n", ms_since(starting));
  for (const std::string query : {"limit=20", "limit=1000", "limit=20&state=failed", "limit=20&state=queued"}) {
    std::vector<double> times;
    std::string target = "/v1/jobs?" + query;
    for (int page = 0; page < 30 && !target.empty(); ++page) {
      const auto answer = timed(times, [&] { return server->get(target).json(); });
      target = answer.contains("next_cursor")
                   ? fmt::format("/v1/jobs?{}&cursor={}", query, answer["next_cursor"].get<std::string>())
                   : "";
    }
    fmt::print("GET /v1/jobs?{}: {}\n", query, spread(times));
  }
}

/// Lets the jobs expire, while others are submitted and ended, and says how long these took.
void Load::expire(const std::string& url, std::int64_t jobs) {
  const auto housekeeper = open(url), store = open(url);
  std::vector<double> looking, removing, submitting;
  for (int look = 0; look < 10; ++look) {
    submit(*store, 1);
    store->fail(store->claim("worker", kLease).value(), {});
    timed(looking, [&] { return housekeeper->remove_expired(); });
  }
  fmt::print("a look for what has expired, with nothing: {}\n", spread(looking));
  run(url, fmt::format("UPDATE jobs SET expires = now_ms() - 1 WHERE id IN"
                       " (SELECT id FROM jobs WHERE expires IS NOT NULL ORDER BY seq LIMIT {})",
                       jobs));
  std::atomic<bool> done = false;
  std::jthread other([&] {
    while (!done) append(submitting, submit(*store, 1));
  });
  std::size_t removed = 0;
  const auto start = Clock::now();
  while (removed < static_cast<std::size_t>(jobs)) {
    removed += timed(removing, [&] { return housekeeper->remove_expired(); }).size();
  }
  const double seconds = ms_since(start) / 1000;
  done = true;
  other.join();
  fmt::print("{} jobs expire: {:.0f}/s, in calls of {}; submissions meanwhile {}\n", removed,
             static_cast<double>(removed) / seconds, spread(removing), spread(submitting));
}

void Load::million(std::int64_t jobs) {
  const std::string url = database_.create_database();
  {
    const auto store = open(url);
    submit(*store, 1);
  }
  end_all(url, 1, 1);
  const auto start = Clock::now();
  fill_with_ended_jobs(url, jobs);
  fmt::print("{} ended jobs made in {:.0f} s: {}\n", jobs, ms_since(start) / 1000, sizes(url, jobs));
  list_pages(url);
  {
    const auto store = open(url);
    for (const std::string state : {"", "succeeded", "failed", "queued"}) {
      std::vector<double> times;
      for (int page = 0; page < 10; ++page) timed(times, [&] { return store->list(state, 20, "", kLuckyOwner); });
      fmt::print("a page of the jobs of a key with half of them, state '{}': {}\n", state, spread(times));
    }
  }
  submit(*open(url), 2'000);
  fmt::print("64 workers, 2000 jobs: {}\n", end_all(url, 64, 2'000));
  expire(url, jobs / 10);
  const auto dead = [&](const std::string& table) {
    return value(url,
                 "SELECT n_dead_tup || ' of ' || n_live_tup FROM pg_stat_user_tables WHERE relname = '" + table + "'");
  };
  fmt::print("dead rows: jobs {}, files {}, chunks {}\n", dead("jobs"), dead("files"), dead("chunks"));
  fmt::print("after VACUUM: {}\n", sizes(url, jobs));
}

int run(const std::vector<std::string>& steps) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  creased::configure_log("text", "critical");
  Load load;
  const auto runs = [&](const std::string& step) {
    return steps.empty() || std::ranges::find(steps, step) != steps.end();
  };
  if (runs("claims")) load.claims();
  if (runs("changes")) load.changes();
  if (runs("events")) load.events();
  if (runs("idle")) load.idle();
  if (runs("storage")) load.storage();
  if (runs("million")) load.million(steps.size() == 2 ? std::stoll(steps[1]) : 1'000'000);
  return 0;
}

}  // namespace
}  // namespace crease::test

int main(int argc, char** argv) {
  try {
    return crease::test::run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    fmt::print(stderr, "shared_load: {}\n", error.what());
    return 1;
  }
}
