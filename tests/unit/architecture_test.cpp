#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <regex>

#include "tests/support/source_tree.h"

namespace crease {
namespace {

using testing::IsEmpty;

/// The rooms that have a paragraph: lines that start with **`room`**.
test::Paths rooms_on_the_page() {
  const std::string page = test::source_text("core/ARCHITECTURE.md");
  const std::regex heading(R"(\n\*\*`([a-z_/]+)`\*\* )");
  test::Paths rooms;
  for (std::sregex_iterator match(page.begin(), page.end(), heading), end; match != end; ++match) {
    EXPECT_TRUE(rooms.insert((*match)[1]).second) << (*match)[1] << " has two paragraphs";
  }
  return rooms;
}

/// The relative links of a page that lead nowhere.
std::vector<std::string> broken_links(const std::string& page) {
  const std::string text = test::source_text(page);
  const std::regex link(R"(\]\(([^):#]+)\))");
  std::vector<std::string> broken;
  for (std::sregex_iterator match(text.begin(), text.end(), link), end; match != end; ++match) {
    const auto target = (test::source_root() / page).parent_path() / (*match)[1].str();
    if (!std::filesystem::exists(target)) broken.push_back((*match)[1]);
  }
  return broken;
}

TEST(Architecture, HasOneParagraphForEveryRoom) { EXPECT_EQ(rooms_on_the_page(), test::rooms()); }

TEST(Documents, LinksLeadToFiles) {
  for (const std::string page : {"README.md", "CHANGELOG.md", "CONTRIBUTING.md", "core/ARCHITECTURE.md",
                                 "server/OPERATION.md", "server/SECURITY.md", "server/transport/REASONS.md"}) {
    EXPECT_THAT(broken_links(page), IsEmpty()) << page;
  }
}

TEST(Documents, PathsExist) {
  for (const std::string page : {"README.md", "core/ARCHITECTURE.md", "server/OPERATION.md", "server/SECURITY.md"}) {
    for (const std::string& path : test::paths_in(test::source_text(page))) {
      EXPECT_TRUE(std::filesystem::exists(test::source_root() / path)) << page << " names " << path;
    }
  }
}

}  // namespace
}  // namespace crease
