#include "server/postgresql/session.h"

#include <fmt/format.h>
#include <poll.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>

#include "server/base/failure.h"

namespace creased {
namespace code = crease::code;
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kFirstPause{50}, kLongestPause{5'000};
constexpr std::size_t kMostSessions = 16;

// A session whose machine has vanished must not hold locks for long. Statements are for few rows of large tables,
// whatever the statistics say.
constexpr const char* kSettings =
    "SET client_min_messages = warning; SET lock_timeout = '20s'; SET idle_in_transaction_session_timeout = '30s';"
    " SET statement_timeout = '120s'; SET tcp_keepalives_idle = 10; SET tcp_keepalives_interval = 5;"
    " SET tcp_keepalives_count = 3; SET enable_seqscan = off; SET jit = off";

bool is_readable(int socket) {
  pollfd watched{.fd = socket, .events = POLLIN, .revents = 0};
  return ::poll(&watched, 1, 0) != 0;
}

crease::Error away() { return {code::kStoreUnavailable, "the database cannot be reached"}; }

}  // namespace

std::string bytes_of(const pqxx::field& field) { return pqxx::binarystring(field).str(); }

std::string with_timeouts(const std::string& url) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 6> kDefaults = {
      {{"connect_timeout", "5"},
       {"tcp_user_timeout", "10000"},
       {"keepalives_idle", "5"},
       {"keepalives_interval", "3"},
       {"keepalives_count", "3"},
       {"application_name", "creased"}}};
  std::string full = url;
  for (const auto& [name, value] : kDefaults) {
    if (url.find(fmt::format("{}=", name)) != std::string::npos) continue;
    full += fmt::format("{}{}={}", full.find('?') == std::string::npos ? '?' : '&', name, value);
  }
  return full;
}

Session::Session(const std::string& url) : connection_(url) { pqxx::nontransaction(connection_).exec(kSettings); }

const std::string& Session::prepared(std::string_view sql) {
  auto found = statements_.find(sql);
  if (found == statements_.end()) {
    const std::string name = fmt::format("s{}", statements_.size());
    connection_.prepare(name, std::string(sql));
    found = statements_.emplace(std::string(sql), name).first;
  }
  return found->second;
}

bool Session::spent() const { return spoilt_ || !connection_.is_open() || is_readable(connection_.sock()); }

std::unique_ptr<Session> SessionPool::take() {
  std::unique_lock lock(mutex_);
  returned_.wait(lock, [this] { return in_use_ < kMostSessions; });
  while (!idle_.empty()) {
    auto session = std::move(idle_.back());
    idle_.pop_back();
    if (session->spent()) continue;
    ++in_use_;
    return session;
  }
  if (Clock::now() < next_try_) throw away();
  ++in_use_;
  lock.unlock();
  try {
    auto session = std::make_unique<Session>(url_);
    lock.lock();
    pause_ = {};
    return session;
  } catch (const pqxx::pqxx_exception& exception) {
    // Callers need not know where the database is.
    spdlog::warn("the database cannot be reached: {}", first_line(exception.base().what()));
    give_back(nullptr);
    lock.lock();
    pause_ = std::clamp(pause_ * 2, kFirstPause, kLongestPause);
    next_try_ = Clock::now() + pause_;
    throw away();
  }
}

void SessionPool::give_back(std::unique_ptr<Session> session) {
  {
    const std::lock_guard lock(mutex_);
    --in_use_;
    if (session != nullptr && !session->spent()) idle_.push_back(std::move(session));
  }
  returned_.notify_one();
}

Transaction::Transaction(SessionPool& pool, View view) : pool_(pool), session_(pool.take()) {
  try {
    if (view == View::kFrozen) {
      work_ = std::make_unique<pqxx::transaction<pqxx::repeatable_read>>(session_->connection());
    } else {
      work_ = std::make_unique<pqxx::work>(session_->connection());
    }
  } catch (...) {
    pool_.give_back(nullptr);
    throw;
  }
}

Transaction::~Transaction() {
  work_.reset();
  pool_.give_back(std::move(session_));
}

void Transaction::relax() { run("SELECT set_config('synchronous_commit', 'off', true)"); }

void Transaction::commit() {
  spoiling([&] { work_->commit(); });
}

std::string first_line(std::string_view text) { return std::string(text.substr(0, text.find('\n'))); }

void throw_as_store_error(const pqxx::pqxx_exception& exception) {
  if (dynamic_cast<const pqxx::broken_connection*>(&exception) != nullptr) {
    throw crease::Error(code::kStoreUnavailable, "the connection to the database was lost");
  }
  constexpr std::string_view kDiskFull = "53100";
  const auto* const failed = dynamic_cast<const pqxx::sql_error*>(&exception);
  const bool full = failed != nullptr && failed->sqlstate() == kDiskFull;
  throw crease::Error(full ? code::kStorageFull : code::kStoreUnavailable,
                      fmt::format("database error: {}", first_line(exception.base().what())));
}

}  // namespace creased
