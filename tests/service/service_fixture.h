#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "tests/support/meshes.h"
#include "tests/support/server_process.h"

namespace crease::test {

inline std::string obj_text(const Mesh& mesh) {
  std::string text;
  for (const auto& p : mesh.positions) text += fmt::format("v {} {} {}\n", p.x(), p.y(), p.z());
  for (const auto& t : mesh.triangles) text += fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  return text;
}

/// A cube with 192 faces, which `kQuick` smooths at once.
inline const std::string& small_obj() {
  static const std::string text = obj_text(cube(4));
  return text;
}
inline const std::string kQuick = "sweeps=3";
/// Parameters for a job of minutes with a mesh of some thousand faces, so that a test can act while it runs.
inline const std::string kLong = "sweeps=100000";

/// A server for the tests of a suite, with few threads so that it starts fast.
class ServiceTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    server_ = std::make_unique<ServerProcess>(
        std::vector<std::string>{"--workers", "1", "--max-connections", "64", "--max-streams", "32"});
  }
  static void TearDownTestSuite() { server_.reset(); }
  static ServerProcess& server() { return *server_; }
  static int port() { return server_->port(); }

  static RawResponse call(const std::string& method, const std::string& target, const Headers& headers = {},
                          const std::string& body = {}) {
    return exchange(port(), method, target, headers, body);
  }

  static nlohmann::json finished_job() {
    return server().wait_for_end(server().submit(small_obj(), kQuick)["id"].get<std::string>());
  }

  static std::string path_of(const nlohmann::json& job) { return "/v1/jobs/" + job["id"].get<std::string>(); }

 private:
  static inline std::unique_ptr<ServerProcess> server_;
};

}  // namespace crease::test
