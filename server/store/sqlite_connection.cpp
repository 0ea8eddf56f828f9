#include "server/store/sqlite_connection.h"

#include <sqlite3.h>

#include <utility>

#include "server/base/failure.h"

namespace creased {
namespace code = crease::code;
namespace {

constexpr int kBusyTimeoutMs = 10'000;
const int kOpenFlags = SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE | SQLite::OPEN_NOMUTEX;

const char* settings(Connection::Role role) {
  switch (role) {
    case Connection::Role::kReader:
      return "PRAGMA query_only = ON";
    case Connection::Role::kWriter:
      return "PRAGMA synchronous = NORMAL";
    case Connection::Role::kDurable:
      break;
  }
  return "PRAGMA synchronous = FULL";
}

}  // namespace

Connection::Connection(const std::filesystem::path& path, Role role)
    : database_(path.string(), kOpenFlags, kBusyTimeoutMs) {
  // SQLite opens a file for reading when it cannot open it for writing, and never tries again.
  if (::sqlite3_db_readonly(database_.getHandle(), "main") != 0) {
    throw crease::Error(code::kStoreUnavailable, "the database " + path.string() + " can only be read");
  }
  database_.exec("PRAGMA foreign_keys = ON");
  database_.exec("PRAGMA secure_delete = ON");  // overwrites deleted content in the file
  database_.exec(settings(role));
}

bool Connection::broken() const {
  constexpr int kPrimaryCode = 0xff;
  switch (database_.getErrorCode() & kPrimaryCode) {
    case SQLITE_IOERR:
    case SQLITE_CANTOPEN:
    case SQLITE_READONLY:
    case SQLITE_NOTADB:
    case SQLITE_CORRUPT:
    case SQLITE_PROTOCOL:
    case SQLITE_FULL:
      return true;
    default:
      return false;
  }
}

SQLite::Statement& Connection::prepared(std::string_view sql) {
  const auto found = statements_.find(sql);
  if (found != statements_.end()) return found->second;
  std::string text(sql);
  SQLite::Statement statement(database_, text);
  return statements_.emplace(std::move(text), std::move(statement)).first->second;
}

std::optional<std::int64_t> Query::optional_integer(int column) const {
  if (is_null(column)) return std::nullopt;
  return integer(column);
}

void Query::bind(int place, const Blob& value) {
  statement_.bindNoCopy(place, value.bytes.data(), static_cast<int>(value.bytes.size()));
}

void Query::bind(int place, const std::optional<std::string>& value) {
  value ? statement_.bind(place, *value) : statement_.bind(place);
}

ReaderPool::ReaderPool(std::filesystem::path path, std::size_t size) : path_(std::move(path)), unopened_(size) {}

std::unique_ptr<Connection> ReaderPool::take() {
  std::unique_lock lock(mutex_);
  returned_.wait(lock, [this] { return !idle_.empty() || unopened_ > 0; });
  if (!idle_.empty()) {
    auto connection = std::move(idle_.back());
    idle_.pop_back();
    return connection;
  }
  auto connection = std::make_unique<Connection>(path_, Connection::Role::kReader);
  --unopened_;
  return connection;
}

void ReaderPool::give_back(std::unique_ptr<Connection> connection) {
  {
    const std::lock_guard lock(mutex_);
    if (connection->broken()) {
      connection.reset();
      ++unopened_;
    } else {
      idle_.push_back(std::move(connection));
    }
  }
  returned_.notify_one();
}

Connection& Writer::opened() {
  if (connection_ == nullptr) connection_ = std::make_unique<Connection>(path_, role_);
  return *connection_;
}

bool Writer::empty_log() {
  constexpr int kPatienceMs = 100;
  const std::lock_guard lock(mutex_);
  sqlite3* const database = opened().database().getHandle();
  ::sqlite3_busy_timeout(database, kPatienceMs);
  const int result = ::sqlite3_wal_checkpoint_v2(database, nullptr, SQLITE_CHECKPOINT_TRUNCATE, nullptr, nullptr);
  ::sqlite3_busy_timeout(database, kBusyTimeoutMs);
  if (connection_->broken()) connection_.reset();
  return result == SQLITE_OK;
}

Writer::Transaction::Transaction(Writer& writer) : lock_(writer.mutex_), writer_(writer) {
  try {
    transaction_.emplace(writer_.opened().database(), SQLite::TransactionBehavior::IMMEDIATE);
  } catch (...) {
    close_if_broken();
    throw;
  }
}

Writer::Transaction::~Transaction() { close_if_broken(); }

void Writer::Transaction::commit() {
  try {
    transaction_->commit();
  } catch (...) {
    close_if_broken();
    throw;
  }
}

void Writer::Transaction::close_if_broken() {
  if (writer_.connection_ == nullptr || !writer_.connection_->broken()) return;
  transaction_.reset();
  writer_.connection_.reset();
}

}  // namespace creased
