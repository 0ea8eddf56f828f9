#pragma once

#include <filesystem>

#include "server/store/job_files.h"
#include "server/store/store.h"

namespace creased {

/// Refuses to begin a new database beside the files of old jobs, unless the options say what to do with these; discards
/// them when the options say so.
/// \throw Error store_unavailable
void refuse_lost_database(const std::filesystem::path& database, const JobFiles& files, const StoreOptions& options);

/// Checks an existing database. A damaged one is set aside under another name, and what can be read of it is copied
/// into a new one. The rest is for the records beside the uploads. The log says what was found. \throw Error
/// store_unavailable; SQLite::Exception
void mend_database(const std::filesystem::path& database, const JobFiles& files);

}  // namespace creased
