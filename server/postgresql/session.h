#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <pqxx/pqxx>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/store/store.h"

namespace creased {

/// Bytes to bind to a statement. They must outlive the call.
struct Bytes {
  std::string_view bytes;
};

/// The bytes of a field of type bytea.
std::string bytes_of(const pqxx::field& field);

/// A connection with its prepared statements, for one thread at a time. It is never opened anew: what was begun on it
/// is lost with it.
class Session {
 public:
  /// \throw pqxx::broken_connection
  explicit Session(const std::string& url);

  pqxx::connection& connection() { return connection_; }
  /// The name of a statement, which is prepared at its first use.
  const std::string& prepared(std::string_view sql);
  /// Whether the server has closed the connection, or a statement failed on it.
  bool spent() const;
  void spoil() { spoilt_ = true; }

 private:
  pqxx::connection connection_;
  pqxx::quiet_errorhandler quiet_{connection_};  // what goes wrong is thrown as well
  std::map<std::string, std::string, std::less<>> statements_;
  bool spoilt_ = false;
};

/// The sessions of a process, opened when they are needed, at most 16; a thread waits while all are in use. While the
/// server is away, tries to reach it are made with growing pauses, and calls in between fail at once.
class SessionPool {
 public:
  /// A URL of libpq with time-outs added where it has none.
  explicit SessionPool(std::string url) : url_(std::move(url)) {}

  /// \throw Error store_unavailable
  std::unique_ptr<Session> take();
  /// Null for one that was taken and is gone.
  void give_back(std::unique_ptr<Session> session);

 private:
  using Clock = std::chrono::steady_clock;

  const std::string url_;
  std::mutex mutex_;
  std::condition_variable returned_;
  std::size_t in_use_ = 0;
  std::vector<std::unique_ptr<Session>> idle_;
  Clock::time_point next_try_;
  std::chrono::milliseconds pause_{0};
};

/// A URL with the times after which a server that does not answer counts as away, where it sets none itself.
std::string with_timeouts(const std::string& url);

/// A transaction. Rolls back unless committed. Statements see what was committed before each of them, or with kFrozen
/// before the first.
class Transaction {
 public:
  enum class View { kCurrent, kFrozen };
  explicit Transaction(SessionPool& pool, View view = View::kCurrent);
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;

  /// Runs a statement. \throw pqxx::pqxx_exception
  template <class... Args>
  pqxx::result run(std::string_view sql, const Args&... args) {
    return spoiling([&] { return work_->exec_prepared(session_->prepared(sql), parameter(args)...); });
  }
  /// The commit survives the server's process, but may be lost with its machine unless a later one is durable.
  void relax();
  void commit();

 private:
  template <class Call>
  auto spoiling(const Call& call) -> decltype(call()) {
    try {
      return call();
    } catch (const pqxx::pqxx_exception&) {
      session_->spoil();
      throw;
    }
  }
  template <class T>
  static const T& parameter(const T& value) {
    return value;
  }
  static std::string parameter(std::string_view text) { return std::string(text); }
  static const char* parameter(const std::optional<std::string>& text) { return text ? text->c_str() : nullptr; }
  static pqxx::binarystring parameter(const Bytes& value) {
    return pqxx::binarystring(value.bytes.data(), value.bytes.size());
  }

  SessionPool& pool_;
  std::unique_ptr<Session> session_;
  std::unique_ptr<pqxx::dbtransaction> work_;
};

/// The first line of an error's text: the rest is for those who wrote the statement.
std::string first_line(std::string_view text);

/// The error of the store that an exception of the client stands for. \pre called in a handler of it
[[noreturn]] void throw_as_store_error(const pqxx::pqxx_exception& exception);

/// Runs `work` and turns exceptions of the client into Error store_unavailable or storage_full.
template <class Work>
auto with_postgresql_errors(const Work& work) -> decltype(work()) {
  try {
    return work();
  } catch (const pqxx::pqxx_exception& exception) {
    throw_as_store_error(exception);
  }
}

}  // namespace creased
