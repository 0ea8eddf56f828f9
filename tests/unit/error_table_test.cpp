#include "proto/error_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>
#include <set>
#include <string>

#include "core/error.h"
#include "proto/convert.h"

namespace crease {
namespace {

TEST(ErrorTable, RowsAreWellFormed) {
  const std::set<int> statuses = {0,   400, 401, 403, 404, 405, 406, 408, 409, 410, 413, 414,
                                  415, 416, 417, 422, 429, 431, 500, 501, 503, 505, 507};
  const std::regex snake_case("[a-z0-9]+(_[a-z0-9]+)*");
  for (const ErrorKind& kind : error_table()) {
    EXPECT_TRUE(std::regex_match(std::string(kind.name), snake_case)) << kind.name;
    EXPECT_THAT(statuses, testing::Contains(kind.status)) << kind.name;
    EXPECT_FALSE(kind.title.empty() || kind.title.ends_with('.')) << kind.name;
    EXPECT_EQ(&error_kind(kind.code), &kind) << kind.name;
    EXPECT_EQ(find_error_kind(kind.name), &kind) << kind.name;
  }
}

TEST(ErrorTable, SaysToTryAgainWhereTheStatusDoes) {
  for (const ErrorKind& kind : error_table()) {
    if (kind.status == 429 || kind.status == 503) {
      EXPECT_GT(kind.retry_after_s, 0) << kind.name;
    }
    if (kind.status == 400 || kind.status == 422) {
      EXPECT_EQ(kind.retry_after_s, 0) << kind.name;
    }
  }
}

TEST(ErrorTable, UnknownNamesAreNotThereAndBecomeInternalErrors) {
  EXPECT_EQ(find_error_kind("no_such_code"), nullptr);
  EXPECT_EQ(find_error_kind(""), nullptr);
  v1::Problem problem;
  problem.set_code("no_such_code");
  problem.set_status(200);
  EXPECT_EQ(to_error(problem).code(), code::kInternal);
  EXPECT_EQ(to_problem(to_error(problem)).status(), 500U);
}

TEST(ToProblem, CopiesEveryMemberOfTheError) {
  const v1::Problem mesh = to_problem(Error(code::kMeshSyntax, "not a number", "line 12"));
  EXPECT_EQ(mesh.code(), "mesh_syntax");
  EXPECT_EQ(mesh.status(), 422U);
  EXPECT_EQ(mesh.title(), error_kind(code::kMeshSyntax).title);
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
