#pragma once

#include <filesystem>

namespace creased {

/// Creates the database, or migrates it from an earlier version. PRAGMA user_version counts the migrations that were
/// applied. Several processes may call this at once.
/// \throw Error store_unavailable for a database of a later version; SQLite::Exception
void prepare_database(const std::filesystem::path& path);

}  // namespace creased
