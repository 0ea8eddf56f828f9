#include "tests/support/store_support.h"

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <iterator>

#include "proto/convert.h"
#include "proto/parameter_table.h"
#include "server/postgresql/postgresql_store.h"
#include "tests/support/postgresql_server.h"

namespace crease::test {

std::string obj_text(const Mesh& mesh) {
  std::string text;
  for (const Vec3& p : mesh.positions) {
    fmt::format_to(std::back_inserter(text), "v {} {} {}\n", p.x(), p.y(), p.z());
  }
  for (const auto& [a, b, c] : mesh.triangles) {
    fmt::format_to(std::back_inserter(text), "f {} {} {}\n", a + 1, b + 1, c + 1);
  }
  return text;
}

pid_t fork_process(const std::function<int()>& work) {
  const pid_t process = ::fork();
  if (process == 0) {
    int code = 1;
    try {
      code = work();
    } catch (const std::exception& error) {
      fmt::print(stderr, "{}\n", error.what());
    }
    ::_exit(code);
  }
  return process;
}

int wait_for_process(pid_t process) {
  int status = 0;
  ::waitpid(process, &status, 0);
  return status;
}

std::unique_ptr<creased::Store> open_tested_store(creased::StoreOptions options) {
  options.url = store_url(options.data_dir);
  return tests_on_postgresql() ? creased::open_postgresql_store(options) : creased::open_store(options);
}

creased::NewJob new_job(creased::Store& store, const std::string& fingerprint, const std::string& upload,
                        const v1::Parameters& parameters) {
  creased::NewJob job;
  job.fingerprint = fingerprint;
  job.upload = store.temporary_path();
  std::ofstream(job.upload, std::ios::binary) << upload;
  job.parameters = resolve(parameters);
  job.input.set_name("part.obj");
  job.input.set_format("obj");
  job.input.set_bytes(static_cast<std::uint32_t>(upload.size()));
  job.input.set_sha256(sha256_hex(upload));
  job.request_digest = "digest of " + fingerprint;
  return job;
}

}  // namespace crease::test
