#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <ostream>
#include <vector>

#include "tests/fuzz/target.h"
#include "tests/support/meshes.h"

namespace crease::fuzz {

void PrintTo(const Target& target, std::ostream* out) { *out << target.name; }

namespace {

namespace fs = std::filesystem;

std::vector<fs::path> inputs(std::string_view kind, std::string_view target) {
  const fs::path folder = fs::path(CREASED_SOURCE_DIR) / "tests/fuzz" / kind / target;
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

INSTANTIATE_TEST_SUITE_P(Targets, FuzzReplay, testing::ValuesIn(targets().begin(), targets().end()),
                         [](const auto& parameter) { return std::string(parameter.param.name); });

}  // namespace
}  // namespace crease::fuzz
