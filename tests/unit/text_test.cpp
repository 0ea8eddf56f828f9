#include "core/base/text.h"

#include <gtest/gtest.h>

#include <array>

namespace crease {
namespace {

TEST(Text, TrimmingTakesBlanksAndTabsFromTheEndsOnly) {
  EXPECT_EQ(trimmed(" \ta b\tc \t"), "a b\tc");
  EXPECT_EQ(trimmed(" \t "), "");
  EXPECT_EQ(trimmed("\na\n"), "\na\n");
}

TEST(Text, CaseIsThatOfAsciiLettersAlone) {
  EXPECT_EQ(lower("Part-[Z].OBJ"), "part-[z].obj");
  EXPECT_EQ(lower("\xc3\x84"), "\xc3\x84");
  EXPECT_TRUE(equals_ignoring_case("Content-Type", "content-tYPE"));
  EXPECT_FALSE(equals_ignoring_case("@", "`"));
  EXPECT_FALSE(equals_ignoring_case("ab", "abc"));
}

TEST(Text, HexHasTwoDigitsForEachByte) {
  EXPECT_EQ(hex({}), "");
  EXPECT_EQ(hex(std::array<unsigned char, 4>{0x00, 0x0a, 0x7f, 0xff}), "000a7fff");
}

TEST(Text, OnlyBytesThatAreNotUtf8AreReplaced) {
  EXPECT_EQ(valid_utf8("Gr\xc3\xbc\xc3\x9f\n\"e\"\\"), "Gr\xc3\xbc\xc3\x9f\n\"e\"\\");
  EXPECT_EQ(valid_utf8("a\xff"
                       "b"),
            "a\xef\xbf\xbd"
            "b");
}

TEST(Text, WhatIsQuotedIsShortAndPrintable) {
  EXPECT_EQ(printable("a\nb\xff"), "a?b?");
  EXPECT_EQ(printable(std::string(33, 'x')), std::string(32, 'x') + "...");
}

}  // namespace
}  // namespace crease
