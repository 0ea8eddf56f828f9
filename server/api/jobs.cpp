#include "server/api/jobs.h"

#include "proto/convert.h"

namespace creased {
namespace code = crease::code;
namespace {

constexpr double kDefaultPage = 50;

crease::Error not_found(const std::string& id) { return {code::kJobNotFound, "no job '" + id + "'"}; }

crease::v1::Job with_links(crease::v1::Job job, const std::string& base) {
  const std::string self = base + "/v1/jobs/" + job.id();
  auto& links = *job.mutable_links();
  links.set_self(self);
  links.set_events(self + "/events");
  links.set_mesh(self + "/mesh");
  links.set_labels(self + "/labels");
  links.set_ridges(self + "/ridges");
  links.set_report(self + "/report");
  links.set_cancel(self + "/cancel");
  return job;
}

void list_jobs(Services& services, Call& call) {
  const auto limit = static_cast<std::size_t>(call.query_number("limit", kDefaultPage));
  const JobPage page = services.store.list(call.query("state"), limit, call.query("cursor"), call.owner());
  crease::v1::JobList answer;
  for (const auto& job : page.jobs) *answer.add_jobs() = with_links(job, call.exchange.base);
  if (!page.next_cursor.empty()) answer.set_next_cursor(page.next_cursor);
  call.response.set_content(crease::json_text(answer), "application/json");
}

void get_job(Services& services, Call& call) {
  call.response.set_content(job_json(find_job(services.store, call), call.exchange.base), "application/json");
}

void cancel_job(Services& services, Call& call) {
  const auto job = services.store.cancel(call.id, call.owner());
  if (!job) throw not_found(call.id);
  services.watcher.refresh(call.id);
  call.response.status = is_terminal(job->state()) ? 200 : 202;
  call.response.set_content(job_json(*job, call.exchange.base), "application/json");
}

void delete_job(Services& services, Call& call) {
  if (!services.store.remove(call.id, call.owner())) throw not_found(call.id);
  services.watcher.refresh(call.id);
  services.metrics.forget(call.id);
  call.response.status = 204;
}

}  // namespace

crease::v1::Job find_job(Store& store, const Call& call) {
  auto job = store.find(call.id, call.owner());
  if (!job) throw not_found(call.id);
  return std::move(*job);
}

std::string job_json(const crease::v1::Job& job, const std::string& base) {
  return crease::json_text(with_links(job, base));
}

std::vector<Route> job_routes() {
  return {
      {"GET",
       "/v1/jobs",
       "list_jobs",
       "List jobs, newest first",
       {{"state", "string", "Only jobs in this state.", {"queued", "running", "succeeded", "failed", "cancelled"}},
        {"limit", "integer", "Number of jobs on a page.", {}, 1, 1000},
        {"cursor", "string", "Start of the page: next_cursor of the page before."}},
       {{200, "A page of jobs.", {kJson}, "JobList"}},
       {code::kParameterInvalid, code::kParameterOutOfRange},
       list_jobs},
      {"GET",
       "/v1/jobs/{id}",
       "get_job",
       "Get a job: state, input, parameters, progress, result",
       {},
       {{200, "The job.", {kJson}, "Job"}},
       {code::kJobNotFound},
       get_job},
      {"DELETE",
       "/v1/jobs/{id}",
       "delete_job",
       "Delete a job and all its data",
       {},
       {{204, "The job is deleted.", {}, ""}},
       {code::kJobNotFound},
       delete_job},
      {"POST",
       "/v1/jobs/{id}/cancel",
       "cancel_job",
       "Cancel a job",
       {},
       {{202, "The job will stop within one sweep.", {kJson}, "Job"},
        {200, "The job had already ended.", {kJson}, "Job"}},
       {code::kJobNotFound},
       cancel_job},
  };
}

}  // namespace creased
