#include "server/api/jobs.h"

#include "proto/convert.h"

namespace creased {
namespace {

constexpr double kDefaultPage = 50;

crease::Error not_found(const std::string& id) { return {"job_not_found", "no job '" + id + "'"}; }

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

}  // namespace

crease::v1::Job find_job(Store& store, const Call& call) {
  auto job = store.find(call.id, call.owner());
  if (!job) throw not_found(call.id);
  return std::move(*job);
}

std::string job_json(const crease::v1::Job& job, const std::string& base) {
  return crease::json_text(with_links(job, base));
}

void list_jobs(Services& services, Call& call) {
  const auto limit = static_cast<std::size_t>(query_number(call.request.params, "limit", kDefaultPage));
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

}  // namespace creased
