#include "tests/support/key_file.h"

#include <fstream>
#include <sstream>
#include <stdexcept>

namespace crease::test {

Headers TestKey::with(const Headers& more) const {
  Headers all = bearer();
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

TestKey make_test_key(const std::string& name, const nlohmann::json& members) {
  const Finished made = run_program({CREASED_BIN, "key", name});
  if (made.exit_code != 0) throw std::runtime_error("no key: " + made.errors);
  std::istringstream lines(made.output);
  TestKey key;
  std::string entry;
  std::getline(lines, key.text);
  std::getline(lines, entry);
  key.entry = nlohmann::json::parse(entry);
  key.entry.update(members);
  return key;
}

void TestKeyFile::write(const std::vector<TestKey>& keys) const {
  nlohmann::json document = {{"keys", nlohmann::json::array()}};
  for (const auto& key : keys) document["keys"].push_back(key.entry);
  write_text(document.dump());
}

void TestKeyFile::write_text(const std::string& text) const {
  std::ofstream(path()) << text;
  std::filesystem::permissions(path(), std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
}

}  // namespace crease::test
