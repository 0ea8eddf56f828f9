#pragma once

#include <pqxx/pqxx>

namespace creased {

/// Creates the tables, or migrates them from an earlier version. Several processes may call this at once: they take
/// turns. \throw pqxx::pqxx_exception; Error store_unavailable when the tables are of a version whose programs this one
/// cannot work beside
void prepare_tables(pqxx::connection& connection);

}  // namespace creased
