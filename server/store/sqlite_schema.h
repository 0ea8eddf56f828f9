#pragma once

#include <filesystem>

namespace creased {

/// Creates the database, or brings one of an earlier version to the present schema; PRAGMA user_version counts the
/// migrations that it has seen. Safe when several processes do it at once.
/// \throw Error store_unavailable for a database of a later version; SQLite::Exception
void prepare_database(const std::filesystem::path& path);

}  // namespace creased
