#include "proto/error_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <regex>
#include <set>
#include <string>

#include "core/error.h"
#include "proto/convert.h"
#include "tests/support/meshes.h"

namespace crease {
namespace {

/// The text of all source files of core and server.
std::string sources() {
  std::string text;
  for (const char* room : {"core", "server"}) {
    for (const auto& entry :
         std::filesystem::recursive_directory_iterator(std::filesystem::path(CREASED_SOURCE_DIR) / room)) {
      const auto extension = entry.path().extension();
      if (extension == ".h" || extension == ".cpp") text += test::read_file(entry.path());
    }
  }
  return text;
}

TEST(ErrorTable, IsOrderedByUniqueCodes) {
  const auto table = error_table();
  EXPECT_EQ(std::ranges::adjacent_find(table, std::ranges::greater_equal{}, &ErrorKind::code), table.end());
}

TEST(ErrorTable, HasEveryCodeOfCoreAsAClientError) {
  for (const std::string_view code : code::kAllCodes) {
    EXPECT_EQ(error_kind(code).code, code);
    EXPECT_GE(error_kind(code).status, 400);
    EXPECT_LT(error_kind(code).status, 500);
  }
}

TEST(ErrorTable, HasEveryCodeThatIsThrownByName) {
  const std::string text = sources();
  const std::regex thrown(R"re(\bError\("([a-z0-9_]+)")re");
  for (std::sregex_iterator match(text.begin(), text.end(), thrown), end; match != end; ++match) {
    EXPECT_EQ(error_kind((*match)[1].str()).code, (*match)[1].str());
  }
}

TEST(ErrorTable, HasNoUnusedCode) {
  const std::string text = sources();
  for (const ErrorKind& kind : error_table()) {
    EXPECT_NE(text.find('"' + std::string(kind.code) + '"'), std::string::npos) << kind.code;
  }
}

TEST(ErrorTable, RowsAreWellFormed) {
  const std::set<int> statuses = {400, 401, 403, 404, 405, 406, 408, 409, 410, 413, 414,
                                  415, 416, 417, 422, 429, 431, 500, 501, 503, 505, 507};
  const std::regex snake_case("[a-z0-9]+(_[a-z0-9]+)*");
  for (const ErrorKind& kind : error_table()) {
    EXPECT_TRUE(std::regex_match(std::string(kind.code), snake_case)) << kind.code;
    EXPECT_THAT(statuses, testing::Contains(kind.status)) << kind.code;
    EXPECT_FALSE(kind.title.empty() || kind.title.ends_with('.')) << kind.code;
  }
}

TEST(ErrorTable, UnknownCodesAreInternalErrors) {
  EXPECT_EQ(error_kind("no_such_code").code, "internal");
  EXPECT_EQ(error_kind("").status, 500);
}

TEST(ToProblem, CopiesEveryMemberOfTheError) {
  const v1::Problem mesh = to_problem(Error(code::kMeshSyntax, "not a number", "line 12"));
  EXPECT_EQ(mesh.code(), "mesh_syntax");
  EXPECT_EQ(mesh.status(), 422U);
  EXPECT_EQ(mesh.title(), error_kind("mesh_syntax").title);
  EXPECT_EQ(mesh.detail(), "not a number");
  EXPECT_EQ(mesh.place(), "line 12");

  const v1::Problem parameter = to_problem(Error::parameter(code::kParameterInvalid, "seed", "x", "a number"));
  EXPECT_EQ(parameter.field(), "seed");
  EXPECT_EQ(parameter.value(), "x");
  EXPECT_EQ(parameter.expected(), "a number");
  EXPECT_THAT(parameter.detail(), testing::HasSubstr("seed"));
}

TEST(ToProblem, IsValidJsonEvenForBytesThatAreNotText) {
  const std::string bytes("\xff\xfe\xc3", 3);
  const v1::Problem problem = to_problem(Error::parameter(code::kParameterInvalid, bytes, bytes, "a number"));
  EXPECT_EQ(to_json(problem).at("field"), "\uFFFD\uFFFD\uFFFD");
}

}  // namespace
}  // namespace crease
