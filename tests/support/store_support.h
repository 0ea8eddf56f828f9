#pragma once

#include <sys/types.h>

#include <functional>
#include <string>

#include "core/mesh/mesh.h"
#include "server/store/store.h"

namespace crease::test {

/// The mesh as OBJ with every bit of its coordinates.
std::string obj_text(const Mesh& mesh);

/// Runs `work` in a forked process, which ends with its result. No store may be open in this process meanwhile.
pid_t fork_process(const std::function<int()>& work);
/// The wait status of a child of this process.
int wait_for_process(pid_t process);

/// A job of `upload` that is ready to be submitted.
creased::NewJob new_job(creased::Store& store, const std::string& fingerprint, const std::string& upload,
                        const v1::Parameters& parameters = {});

}  // namespace crease::test
