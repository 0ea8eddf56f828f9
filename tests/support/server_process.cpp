#include "tests/support/server_process.h"

#include <algorithm>
#include <csignal>
#include <sstream>
#include <stdexcept>

#include "tests/support/meshes.h"
#include "tests/support/postgresql_server.h"

namespace crease::test {

ServerProcess::ServerProcess(const std::vector<std::string>& flags) : data_dir_(folder_.path() / "data") {
  const auto port_file = folder_.path() / "port";
  std::vector<std::string> command = {CREASED_BIN, "serve", "--port", "0", "--port-file", port_file.string()};
  command.insert(command.end(), flags.begin(), flags.end());
  if (const auto given = std::find(flags.begin(), flags.end(), "--data-dir"); given != flags.end()) {
    data_dir_ = *(given + 1);
  } else {
    command.insert(command.end(), {"--data-dir", data_dir_.string()});
  }
  if (tests_on_postgresql() && std::ranges::find(flags, "--store") == flags.end()) {
    command.insert(command.end(), {"--store", store_url(data_dir_)});
  }
  program_.emplace(command);
  eventually([&] { return std::filesystem::exists(port_file) || program_->ended(); });
  if (!std::filesystem::exists(port_file)) throw std::runtime_error("creased does not start: " + log());
  port_ = std::stoi(read_file(port_file));
}

ServerProcess::~ServerProcess() {
  signal(SIGTERM);
  wait();
}

RawResponse ServerProcess::get(const std::string& target, const Headers& headers) const {
  return exchange(port_, "GET", target, headers);
}

nlohmann::json ServerProcess::submit(const std::string& obj, const std::string& query, const Headers& headers) const {
  Headers all = headers;
  all.emplace_back("Content-Type", "model/obj");
  const auto response = exchange(port_, "POST", "/v1/jobs" + (query.empty() ? "" : "?" + query), all, obj);
  if (response.status != 202 && response.status != 200) throw std::runtime_error("not submitted: " + response.body);
  return response.json();
}

nlohmann::json ServerProcess::wait_for_end(const std::string& id) const {
  const auto events = parse_events(get("/v1/jobs/" + id + "/events").body);
  if (events.empty()) throw std::runtime_error("no events of " + id);
  return nlohmann::json::parse(events.back().data);
}

nlohmann::json ServerProcess::wait_for_state(const std::string& id, const std::string& state,
                                             const Headers& headers) const {
  nlohmann::json job;
  const bool reached = eventually([&] {
    const RawResponse response = get("/v1/jobs/" + id, headers);
    job = response.json();
    if (response.status != 200) throw std::runtime_error(job.dump());
    return job["state"] == state || (job["state"] != "queued" && job["state"] != "running");
  });
  if (!reached) throw std::runtime_error(id + " does not become " + state);
  return job;
}

std::vector<ServerEvent> parse_events(const std::string& stream) {
  std::vector<ServerEvent> events;
  std::istringstream lines(stream);
  ServerEvent event;
  for (std::string line; std::getline(lines, line);) {
    if (line.empty()) {
      if (!event.data.empty()) events.push_back(event);
      event = {};
    } else if (line.starts_with("id: ")) {
      event.id = line.substr(4);
    } else if (line.starts_with("event: ")) {
      event.type = line.substr(7);
    } else if (line.starts_with("data: ")) {
      event.data += line.substr(6);
    }
  }
  return events;
}

}  // namespace crease::test
