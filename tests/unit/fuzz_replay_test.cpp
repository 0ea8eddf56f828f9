#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <ostream>
#include <set>
#include <string>
#include <vector>

#include "tests/fuzz/target.h"
#include "tests/support/meshes.h"

namespace crease::fuzz {

void PrintTo(const Target& target, std::ostream* out) { *out << target.name; }

namespace {

namespace fs = std::filesystem;

fs::path folder_of(std::string_view kind) { return fs::path(CREASED_SOURCE_DIR) / "tests/fuzz" / kind; }

std::vector<fs::path> inputs(std::string_view kind, std::string_view target) {
  const fs::path folder = folder_of(kind) / target;
  std::vector<fs::path> files;
  if (fs::exists(folder)) files.assign(fs::directory_iterator(folder), {});
  std::ranges::sort(files);
  return files;
}

class FuzzReplay : public testing::TestWithParam<Target> {};

TEST_P(FuzzReplay, SeedsAndPastFailuresKeepEveryProperty) {
  ASSERT_FALSE(inputs("corpus", GetParam().name).empty()) << "every fuzzer needs seeds";
  for (const std::string_view kind : {"corpus", "regressions"}) {
    for (const fs::path& file : inputs(kind, GetParam().name)) {
      EXPECT_NO_THROW(GetParam().run(test::read_file(file))) << file;
    }
  }
}

/// What a folder contains, by name without extension.
std::set<std::string> entries(std::string_view kind) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder_of(kind))) names.insert(entry.path().stem().string());
  return names;
}

TEST(FuzzFolders, BelongToTheTargetsOfTheTable) {
  std::set<std::string> names;
  for (const Target& target : targets()) EXPECT_TRUE(names.emplace(target.name).second) << target.name;
  EXPECT_EQ(entries("corpus"), names);
  EXPECT_EQ(entries("dictionaries"), names);
  EXPECT_THAT(entries("regressions"), testing::IsSubsetOf(names));
}

INSTANTIATE_TEST_SUITE_P(Targets, FuzzReplay, testing::ValuesIn(targets().begin(), targets().end()),
                         [](const auto& parameter) { return std::string(parameter.param.name); });

}  // namespace
}  // namespace crease::fuzz
