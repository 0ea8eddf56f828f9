#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <regex>
#include <set>

#include "proto/error_table.h"
#include "server/config.h"
#include "tests/support/meshes.h"

namespace creased {
namespace {

using testing::IsSubsetOf;

std::string page() { return crease::test::read_file(std::filesystem::path(CREASED_SOURCE_DIR) / "server/SECURITY.md"); }

std::set<std::string> all_matches(const std::string& text, const std::string& pattern) {
  const std::regex regex(pattern);
  std::set<std::string> found;
  for (std::sregex_iterator match(text.begin(), text.end(), regex), end; match != end; ++match) {
    found.insert((*match)[1]);
  }
  return found;
}

/// The flags of `creased serve`, or only those in `groups` unless it is empty.
std::set<std::string> flags(const std::set<std::string>& groups = {}) {
  CLI::App app;
  ServeConfig config;
  add_serve_options(app, config);
  std::set<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    if (groups.empty() || groups.contains(option->get_group())) names.insert(option->get_name());
  }
  return names;
}

TEST(SecurityPage, NamesEveryFlagOfAccessAndLimits) {
  const auto wanted = flags({"Access", "Limits"});
  EXPECT_GT(wanted.size(), 25U);
  EXPECT_THAT(wanted, IsSubsetOf(all_matches(page(), "`(--[a-z-]+)")));
}

TEST(SecurityPage, NamesNoUnknownFlag) {
  auto known = flags();
  known.insert("--help");
  EXPECT_THAT(all_matches(page(), "`(--[a-z-]+)"), IsSubsetOf(known));
}

TEST(SecurityPage, NamesEveryCodeOfAccessAndLimits) {
  const std::set<int> statuses = {401, 403, 408, 413, 414, 429, 431, 503, 507};
  const std::set<std::string> named = all_matches(page(), "`([a-z]+(_[a-z]+)*)`");
  for (const auto& kind : crease::error_table()) {
    EXPECT_TRUE(!statuses.contains(kind.status) || named.contains(std::string(kind.name))) << kind.name;
  }
}

TEST(SecurityPage, GivesTheRightStatusOfEachCode) {
  const std::string text = page();
  const std::regex pair("([45][0-9]{2}) `([a-z_]+)`");
  std::size_t count = 0;
  for (std::sregex_iterator match(text.begin(), text.end(), pair), end; match != end; ++match, ++count) {
    const auto* const kind = crease::find_error_kind((*match)[2].str());
    ASSERT_NE(kind, nullptr) << (*match)[2];
    EXPECT_EQ(kind->status, std::stoi((*match)[1])) << kind->name;
  }
  EXPECT_GT(count, 10U);
}

}  // namespace
}  // namespace creased
