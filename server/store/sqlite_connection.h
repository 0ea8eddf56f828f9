#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace creased {

/// Bytes to bind to a query. The bytes must outlive it.
struct Blob {
  const std::string& bytes;
};

/// A connection with its prepared statements, for one thread at a time.
class Connection {
 public:
  enum class Role {
    kReader,   ///< cannot write
    kWriter,   ///< a commit survives this process, but may be lost with the machine unless a durable one follows
    kDurable,  ///< a commit is on the disk when it returns
  };
  /// \throw SQLite::Exception; Error store_unavailable when the database can only be read
  Connection(const std::filesystem::path& path, Role role);

  SQLite::Database& database() { return database_; }
  /// Whether the last call failed so that the connection should be opened anew.
  bool broken() const;
  SQLite::Statement& prepared(std::string_view sql);

 private:
  SQLite::Database database_;
  std::map<std::string, SQLite::Statement, std::less<>> statements_;
};

/// A prepared statement with its arguments bound. The destructor resets it.
class Query {
 public:
  template <class... Args>
  Query(Connection& connection, std::string_view sql, const Args&... args) : statement_(connection.prepared(sql)) {
    int place = 0;
    (bind(++place, args), ...);
  }
  ~Query() { statement_.tryReset(); }
  Query(const Query&) = delete;
  Query& operator=(const Query&) = delete;

  /// Advances to the next row. Returns false at the end.
  bool next() { return statement_.executeStep(); }
  /// Runs a statement that returns no rows. Returns the number of changed rows.
  int run() { return statement_.exec(); }

  std::string text(int column) const { return statement_.getColumn(column).getString(); }
  std::int64_t integer(int column) const { return statement_.getColumn(column).getInt64(); }
  std::optional<std::int64_t> optional_integer(int column) const;
  bool is_null(int column) const { return statement_.getColumn(column).isNull(); }

 private:
  void bind(int place, std::int64_t value) { statement_.bind(place, value); }
  void bind(int place, const std::string& value) { statement_.bind(place, value); }
  void bind(int place, std::string_view value) { statement_.bind(place, std::string(value)); }
  void bind(int place, const Blob& value);
  void bind(int place, const std::optional<std::string>& value);

  SQLite::Statement& statement_;
};

/// A few reading connections, shared by any number of threads. A thread waits while all are in use.
class ReaderPool {
 public:
  ReaderPool(std::filesystem::path path, std::size_t size);

  /// A connection that failed is closed when it comes back.
  class Loan {
   public:
    explicit Loan(ReaderPool& pool) : pool_(pool), connection_(pool.take()) {}
    ~Loan() { pool_.give_back(std::move(connection_)); }
    Loan(const Loan&) = delete;
    Loan& operator=(const Loan&) = delete;
    Connection& operator*() { return *connection_; }

   private:
    ReaderPool& pool_;
    std::unique_ptr<Connection> connection_;
  };

 private:
  std::unique_ptr<Connection> take();
  void give_back(std::unique_ptr<Connection> connection);

  std::filesystem::path path_;
  std::mutex mutex_;
  std::condition_variable returned_;
  std::size_t unopened_;
  std::vector<std::unique_ptr<Connection>> idle_;
};

/// A writing connection, shared by any number of threads. It runs one transaction at a time, and is opened anew after a
/// failure.
class Writer {
 public:
  Writer(std::filesystem::path path, Connection::Role role) : path_(std::move(path)), role_(role) {}

  /// Holds the database's write lock from the start. Rolls back unless committed.
  class Transaction {
   public:
    explicit Transaction(Writer& writer);
    ~Transaction();
    Transaction(const Transaction&) = delete;
    Transaction& operator=(const Transaction&) = delete;

    Connection& operator*() { return *writer_.connection_; }
    void commit();

   private:
    void close_if_broken();

    std::unique_lock<std::mutex> lock_;
    Writer& writer_;
    std::optional<SQLite::Transaction> transaction_;
  };

  /// Empties the log, so that no removed content is left in it. Returns false when readers are in the way.
  bool empty_log();

 private:
  Connection& opened();

  const std::filesystem::path path_;
  const Connection::Role role_;
  std::mutex mutex_;
  std::unique_ptr<Connection> connection_;
};

}  // namespace creased
