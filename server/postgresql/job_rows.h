#pragma once

#include <optional>
#include <pqxx/pqxx>
#include <string>
#include <string_view>

#include "crease/v1/job.pb.h"
#include "server/jobs/life.h"
#include "server/postgresql/session.h"
#include "server/store/job_facts.h"

namespace creased {

/// "SELECT … FROM jobs " and `rest`, with the columns of `job_in`; the last is the place in the order of submission.
std::string select_jobs_with(std::string_view rest);
crease::v1::Job job_in(const pqxx::row& row);
std::int64_t seq_in(const pqxx::row& row);

/// The job with this id, if `owner` may see it.
std::optional<crease::v1::Job> job_with_id(Transaction& transaction, std::string_view id,
                                           const Owner& owner = std::nullopt);

/// The columns of `life_in`, from the first of a row.
std::string_view columns_of_life();
inline constexpr int kColumnsOfLife = 7;
Life life_in(const pqxx::row& row);

/// What an owner, or all together, has in the store.
Usage usage_in(Transaction& transaction, const Owner& owner);

/// The text that a statement has for a state.
inline std::string text_of(JobState state) { return std::string(name_of(state)); }

}  // namespace creased
