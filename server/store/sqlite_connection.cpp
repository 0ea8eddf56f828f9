#include "server/store/sqlite_connection.h"

#include <utility>

namespace creased {
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
  database_.exec("PRAGMA foreign_keys = ON");
  database_.exec("PRAGMA secure_delete = ON");  // overwrites deleted content in the file
  database_.exec(settings(role));
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
    idle_.push_back(std::move(connection));
  }
  returned_.notify_one();
}

}  // namespace creased
