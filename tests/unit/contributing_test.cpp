#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <regex>
#include <string>
#include <vector>

#include "tests/support/source_tree.h"

namespace crease {
namespace {

using testing::IsEmpty;
using testing::IsSubsetOf;
using testing::Not;

/// A recipe of CONTRIBUTING.md, and patterns that find its example in the code and in the tests.
struct Recipe {
  std::string title, in_code, in_tests;
};

const std::vector<Recipe> kRecipes = {
    {"An energy term", R"(\bContinuityTerm\b|energy/continuity\.h)", R"(\bcontinuity_weight\b)"},
    {"A file format", R"(\b(read|write|looks_like)_off\b|io/off\.h|\bkOff\b)", R"(\bkOff\b)"},
    {"A route", R"(\blist_jobs\b)", R"(/v1/jobs\?)"},
    {"A parameter", R"(\bcurvature_weight\b)", R"(\bcurvature_weight\b)"},
};

std::string page() { return test::source_text("CONTRIBUTING.md"); }

/// The text between the heading `title` and the next heading.
std::string section(const std::string& title) {
  const std::string text = page(), heading = "\n### " + title + "\n";
  const auto start = text.find(heading);
  EXPECT_NE(start, std::string::npos) << "no recipe '" << title << "'";
  if (start == std::string::npos) return {};
  return text.substr(start + heading.size(), text.find("\n#", start + heading.size()) - start - heading.size());
}

/// What NAME stands for in a section that says "NAME is `example`".
std::string example_of(const std::string& section) {
  std::smatch match;
  return std::regex_search(section, match, std::regex("NAME is `([a-z_]+)`")) ? match[1].str() : std::string();
}

/// The numbered steps of a section, with the example in place of NAME.
std::string steps_of(const std::string& section) {
  const auto start = section.find("\n1. ");
  if (start == std::string::npos) return {};
  const std::string steps = section.substr(start, section.find("\n\n", start) - start);
  return std::regex_replace(steps, std::regex("NAME"), example_of(section));
}

class RecipeTest : public testing::TestWithParam<Recipe> {
 protected:
  test::Paths steps() const { return test::paths_in(steps_of(section(GetParam().title))); }

  static test::Paths tests_among(test::Paths paths, bool tests) {
    std::erase_if(paths, [&](const std::string& path) { return path.starts_with("tests/") != tests; });
    return paths;
  }
};

TEST_P(RecipeTest, NamesExactlyTheSourcesOfItsExample) {
  const test::Paths sources = test::files_with(GetParam().in_code, {"core", "proto", "server", "client"});
  EXPECT_THAT(sources, Not(IsEmpty()));
  EXPECT_EQ(tests_among(steps(), false), sources);
}

TEST_P(RecipeTest, NamesTestsOfItsExample) {
  const test::Paths tests = tests_among(steps(), true);
  EXPECT_THAT(tests, Not(IsEmpty()));
  EXPECT_THAT(tests, IsSubsetOf(test::files_with(GetParam().in_tests, {"tests"})));
}

INSTANTIATE_TEST_SUITE_P(Contributing, RecipeTest, testing::ValuesIn(kRecipes));

TEST(Contributing, NamesNoFileThatDoesNotExist) {
  const std::regex template_path("NAME");
  for (const std::string& path : test::paths_in(page())) {
    if (std::regex_search(path, template_path)) continue;
    EXPECT_TRUE(std::filesystem::exists(test::source_root() / path)) << path;
  }
}

}  // namespace
}  // namespace crease
