#pragma once

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <mutex>
#include <set>
#include <thread>

#include "core/error.h"
#include "server/base/failure.h"
#include "server/store/job_files.h"
#include "server/store/store.h"
#include "tests/support/meshes.h"
#include "tests/support/server_process.h"
#include "tests/support/store_support.h"

namespace creased::test {
namespace code = crease::code;

namespace fs = std::filesystem;
namespace v1 = crease::v1;
using crease::test::eventually;
using crease::test::fork_process;
using crease::test::new_job;
using crease::test::open_tested_store;
using crease::test::read_file;
using crease::test::wait_for_process;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::MatchesRegex;
using Hold = Store::Hold;

constexpr std::chrono::hours kLong{1};
constexpr std::chrono::milliseconds kOver{-1};  // a lease that has already expired

/// The code of the error that `call` throws, or nothing.
inline std::optional<crease::ErrorCode> error_code(const std::function<void()>& call) {
  try {
    call();
  } catch (const crease::Error& error) {
    return error.code();
  }
  return std::nullopt;
}

class StoreTest : public testing::Test {
 protected:
  std::unique_ptr<Store> open() const {
    StoreOptions options;
    options.data_dir = folder_.path() / "data";
    options.max_queued = 50;
    return open_tested_store(options);
  }
  Store& store() {
    if (!store_) store_ = open();
    return *store_;
  }
  v1::Job submit(const std::string& fingerprint) {
    bool created = false;
    return store().submit(new_job(store(), fingerprint, "upload of " + fingerprint), created);
  }
  std::string state(const std::string& id) { return store().find(id).value().state(); }
  /// The content of a file of a job; nullopt when there is none.
  std::optional<std::string> content(const std::string& id, std::string_view name) {
    const auto file = store().open(id, name);
    if (file == nullptr) return std::nullopt;
    return read_whole(file->descriptor.get(), name);
  }
  // Of the store in files.
  fs::path file_path(const std::string& id, std::string_view name) const { return job_folder(id) / name; }
  fs::path job_folder(const std::string& id) const { return folder_.path() / "data" / "jobs" / id; }
  fs::path incoming() const { return folder_.path() / "data" / "incoming"; }

  const crease::test::TemporaryFolder folder_;
  std::unique_ptr<Store> store_;
};
}  // namespace creased::test
