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

/// Bytes to bind, as opposed to text. Views: they must outlive the query.
struct Blob {
  const std::string& bytes;
};

/// One connection with the statements it has prepared. Of one thread at a time.
class Connection {
 public:
  enum class Role {
    kReader,   ///< cannot write
    kWriter,   ///< a commit survives this process, and the machine up to the last durable commit
    kDurable,  ///< a commit is on the disk when it returns
  };
  Connection(const std::filesystem::path& path, Role role);

  SQLite::Database& database() { return database_; }
  SQLite::Statement& prepared(std::string_view sql);

 private:
  SQLite::Database database_;
  std::map<std::string, SQLite::Statement, std::less<>> statements_;
};

/// A prepared statement with its arguments bound, reset at the end of the scope.
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

  /// True: there is a row.
  bool next() { return statement_.executeStep(); }
  /// For statements without rows: the number of rows changed.
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

/// A few reading connections for any number of threads: who finds none free waits.
class ReaderPool {
 public:
  ReaderPool(std::filesystem::path path, std::size_t size);

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

/// A writing connection for any number of threads, one transaction at a time.
class Writer {
 public:
  Writer(const std::filesystem::path& path, Connection::Role role) : connection_(path, role) {}

  /// Holds the write lock of the database from its start; rolled back unless committed.
  class Transaction {
   public:
    explicit Transaction(Writer& writer)
        : lock_(writer.mutex_),
          connection_(writer.connection_),
          transaction_(connection_.database(), SQLite::TransactionBehavior::IMMEDIATE) {}
    Connection& operator*() { return connection_; }
    void commit() { transaction_.commit(); }

   private:
    std::unique_lock<std::mutex> lock_;
    Connection& connection_;
    SQLite::Transaction transaction_;
  };

 private:
  std::mutex mutex_;
  Connection connection_;
};

}  // namespace creased
