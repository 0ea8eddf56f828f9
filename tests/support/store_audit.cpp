#include "tests/support/store_audit.h"

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>

#include <pqxx/pqxx>

#include "crease/v1/job.pb.h"
#include "crease/v1/result.pb.h"
#include "proto/convert.h"
#include "tests/support/meshes.h"
#include "tests/support/postgresql_server.h"
#include "tests/support/program.h"

namespace crease::test {
namespace fs = std::filesystem;
namespace {

class Audit {
 public:
  Audit(const fs::path& data_dir, bool at_rest)
      : jobs_(data_dir / "jobs"),
        incoming_(data_dir / "incoming"),
        at_rest_(at_rest),
        database_((data_dir / "creased.db").string(), SQLite::OPEN_READWRITE, 10'000) {}

  std::vector<std::string> run(const std::set<std::string>& acknowledged) {
    expect(database_.execAndGet("PRAGMA integrity_check").getString() == "ok", "the database is damaged");
    SQLite::Transaction view(database_);
    for (SQLite::Statement row(database_, "SELECT id, state, input FROM jobs"); row.executeStep();) {
      known_.insert(row.getColumn(0).getString());
      check_job(row.getColumn(0).getString(), row.getColumn(1).getString(), row.getColumn(2).getString());
    }
    for (const auto& id : acknowledged) expect(known_.contains(id), "job " + id + " is lost");
    const bool adds_up = database_
                             .execAndGet(
                                 "SELECT (SELECT coalesce(sum(bytes), 0) FROM usage) ="
                                 " (SELECT coalesce(sum(bytes), 0) FROM jobs) AND"
                                 " (SELECT coalesce(sum(queued), 0) FROM usage) ="
                                 " (SELECT count(*) FROM jobs WHERE state = 'queued')")
                             .getInt() == 1;
    expect(adds_up, "the sums of usage are wrong");
    if (at_rest_) check_leftovers();
    return faults_;
  }

 private:
  void expect(bool well, const std::string& fault) {
    if (!well) faults_.push_back(fault);
  }

  void check_job(const std::string& id, const std::string& state, const std::string& input_bytes) {
    v1::InputFacts input;
    expect(input.ParseFromString(input_bytes), "job " + id + " has damaged facts");
    expect(sha256_hex(read_file(jobs_ / id / "upload")) == input.sha256(), "the upload of job " + id + " has changed");
    v1::LabelledMesh result;
    v1::Report report;
    if (state == "succeeded") {
      expect(result.ParseFromString(read_file(jobs_ / id / "result.pb")) && result.triangles_size() > 0,
             "job " + id + " has no whole result");
      expect(report.ParseFromString(read_file(jobs_ / id / "report.pb")) && report.id() == id,
             "job " + id + " has no whole report");
    }
    if (state == "queued" || state == "running") return;
    for (const auto& entry : fs::directory_iterator(jobs_ / id)) {
      const std::string name = entry.path().filename();
      const bool left = name.ends_with(".part") || name == "checkpoint" || name == "snapshot.pb";
      expect(!at_rest_ || !left, fmt::format("job {} has ended and left {}", id, name));
    }
  }

  void check_leftovers() {
    for (const auto& entry : fs::directory_iterator(jobs_)) {
      expect(known_.contains(entry.path().filename()), "a folder without a job: " + entry.path().string());
    }
    expect(fs::is_empty(incoming_), "something is left in incoming");
    expect(database_.execAndGet("SELECT count(*) FROM removed").getInt() == 0, "a removal is not finished");
  }

  fs::path jobs_, incoming_;
  bool at_rest_;
  SQLite::Database database_;
  std::set<std::string> known_;
  std::vector<std::string> faults_;
};

/// Likewise of a store in PostgreSQL, in one view of it.
class SharedAudit {
 public:
  explicit SharedAudit(const std::string& url) : connection_(url), view_(connection_) {}

  std::vector<std::string> run(const std::set<std::string>& acknowledged, bool at_rest) {
    for (const auto& row : view_.exec("SELECT id, state, input FROM jobs")) {
      known_.insert(row[0].as<std::string>());
      check_job(row[0].as<std::string>(), row[1].as<std::string>(), pqxx::binarystring(row[2]).str(), at_rest);
    }
    for (const auto& id : acknowledged) expect(known_.contains(id), "job " + id + " is lost");
    expect_none("a file without a job", "SELECT job FROM files WHERE job NOT IN (SELECT id FROM jobs)");
    expect_none("a file that is not whole",
                "SELECT job || '/' || name FROM files WHERE bytes <>"
                " (SELECT coalesce(sum(length(chunks.bytes)), 0) FROM chunks WHERE chunks.blob = files.blob)");
    expect_none("content without a file",
                "SELECT DISTINCT blob FROM chunks WHERE blob NOT IN (SELECT blob FROM files UNION ALL"
                " SELECT blob FROM removed)");
    expect_none("wrong sums of usage",
                "SELECT owner FROM usage LEFT JOIN (SELECT owner, sum(bytes) AS of_jobs,"
                " count(*) FILTER (WHERE state = 'queued') AS waiting FROM jobs GROUP BY owner) AS sums USING (owner)"
                " WHERE bytes <> coalesce(of_jobs, 0) OR queued <> coalesce(waiting, 0)");
    if (at_rest) expect_none("a removal that is not finished", "SELECT blob FROM removed");
    return faults_;
  }

 private:
  void expect(bool well, const std::string& fault) {
    if (!well) faults_.push_back(fault);
  }

  void expect_none(const std::string& fault, const std::string& sql) {
    for (const auto& row : view_.exec(sql)) faults_.push_back(fault + ": " + row[0].as<std::string>());
  }

  std::string content(const std::string& id, const std::string& name) {
    std::string bytes;
    for (const auto& row :
         view_.exec_params("SELECT chunks.bytes FROM files JOIN chunks USING (blob) WHERE job = $1 AND"
                           " name = $2 ORDER BY number",
                           id, name)) {
      bytes += pqxx::binarystring(row[0]).str();
    }
    return bytes;
  }

  void check_job(const std::string& id, const std::string& state, const std::string& input_bytes, bool at_rest) {
    v1::InputFacts input;
    expect(input.ParseFromString(input_bytes), "job " + id + " has damaged facts");
    expect(sha256_hex(content(id, "upload")) == input.sha256(), "the upload of job " + id + " has changed");
    v1::LabelledMesh result;
    v1::Report report;
    if (state == "succeeded") {
      expect(result.ParseFromString(content(id, "result.pb")) && result.triangles_size() > 0,
             "job " + id + " has no whole result");
      expect(report.ParseFromString(content(id, "report.pb")) && report.id() == id,
             "job " + id + " has no whole report");
    }
    if (!at_rest || state == "queued" || state == "running") return;
    for (const char* const left : {"checkpoint", "snapshot.pb"}) {
      expect(content(id, left).empty(), fmt::format("job {} has ended and left {}", id, left));
    }
  }

  pqxx::connection connection_;
  pqxx::transaction<pqxx::repeatable_read> view_;
  std::set<std::string> known_;
  std::vector<std::string> faults_;
};

std::string command_of(int process) {
  std::string line = read_file("/proc/" + std::to_string(process) + "/cmdline");
  const auto end = line.find('\0');
  return end == std::string::npos ? "" : line.substr(end + 1, line.find('\0', end + 1) - end - 1);
}

void collect(int process, const std::string& kind, std::vector<int>& found) {
  const std::string parent = command_of(process);
  for (const int child : children_of(process)) {
    const std::string command = command_of(child);
    const std::string is = command == "compute" && parent == "compute" ? "task" : command;
    if (is == kind && (kind != "compute" || parent == "worker")) found.push_back(child);
    if (parent != "serve" || command == "worker") collect(child, kind, found);
  }
}

}  // namespace

std::vector<std::string> faults_of_store(const fs::path& data_dir, const std::set<std::string>& acknowledged,
                                         bool at_rest) {
  if (tests_on_postgresql()) return faults_of_shared_store(store_url(data_dir), acknowledged, at_rest);
  return Audit(data_dir, at_rest).run(acknowledged);
}

std::vector<std::string> faults_of_shared_store(const std::string& url, const std::set<std::string>& acknowledged,
                                                bool at_rest) {
  return SharedAudit(url).run(acknowledged, at_rest);
}

std::vector<int> processes_below(int server, const std::string& kind) {
  std::vector<int> found;
  collect(server, kind, found);
  return found;
}

}  // namespace crease::test
