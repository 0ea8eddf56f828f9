#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/server_process.h"

namespace crease::test {

/// A key made by `creased key`.
// NOLINTNEXTLINE(bugprone-exception-escape): JSON moves without throwing.
struct TestKey {
  std::string text;
  nlohmann::json entry;

  Headers bearer() const { return {{"Authorization", "Bearer " + text}}; }
  /// The headers of `bearer()` and `more`.
  Headers with(const Headers& more) const;
  std::string id() const { return entry["id"]; }
};

/// Makes a key. `members` are added to its entry.
TestKey make_test_key(const std::string& name, const nlohmann::json& members = nlohmann::json::object());

/// A key file in a temporary folder.
class TestKeyFile {
 public:
  explicit TestKeyFile(const std::vector<TestKey>& keys) { write(keys); }

  void write(const std::vector<TestKey>& keys) const;
  void write_text(const std::string& text) const;
  std::string path() const { return (folder_.path() / "keys.json").string(); }

 private:
  TemporaryFolder folder_;
};

}  // namespace crease::test
