#include "server/store/store.h"

#include <fmt/format.h>

#include "server/store/job_row.h"
#include "server/store/sqlite_store.h"

namespace creased {
namespace code = crease::code;
namespace {

StoreOpener postgresql_opener = nullptr;

}  // namespace

bool is_postgresql(std::string_view url) { return url.starts_with("postgresql://") || url.starts_with("postgres://"); }

void enable_postgresql(StoreOpener opener) { postgresql_opener = opener; }

std::unique_ptr<Store> open_store(const StoreOptions& options) {
  if (is_postgresql(options.url)) {
    if (postgresql_opener != nullptr) return postgresql_opener(options);
    throw crease::Error(code::kStoreUnavailable, "this program has no client of PostgreSQL; use creased-postgresql");
  }
  if (options.url != "sqlite") {
    throw crease::Error(code::kStoreUnavailable,
                        fmt::format("unknown store '{}'; use 'sqlite' or postgresql://…", options.url));
  }
  return with_store_errors([&]() -> std::unique_ptr<Store> { return std::make_unique<SqliteStore>(options); });
}

}  // namespace creased
