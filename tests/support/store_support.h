#pragma once

#include <sys/types.h>

#include <functional>
#include <memory>
#include <string>

#include "core/mesh/mesh.h"
#include "server/store/store.h"

namespace crease::test {

/// The mesh as OBJ with exact coordinates.
std::string obj_text(const Mesh& mesh);

/// Runs `work` in a forked process, whose exit code is its result. No store may be open in this process meanwhile.
pid_t fork_process(const std::function<int()>& work);
/// Waits for a child of this process and returns its wait status.
int wait_for_process(pid_t process);

/// The store of these options, or in a database of their folder where the tests are on PostgreSQL.
std::unique_ptr<creased::Store> open_tested_store(creased::StoreOptions options);

/// A job with this upload, ready to submit.
creased::NewJob new_job(creased::Store& store, const std::string& fingerprint, const std::string& upload,
                        const v1::Parameters& parameters = {});

}  // namespace crease::test
