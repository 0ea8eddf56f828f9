#include "core/io/formats.h"

#include <gtest/gtest.h>

#include "tests/unit/decode_samples.h"

namespace crease::test {
namespace {

TEST(MeshFormat, NameAndMediaTypeIdentifyTheFormat) {
  for (const MeshFormat format : kMeshFormats) {
    EXPECT_EQ(format_from_name(format_name(format)), format);
    for (const std::string_view type : format_row(format).media_types) {
      EXPECT_EQ(format_from_media_type(type), format) << type;
    }
    for (const std::string_view extension : format_row(format).extensions) {
      EXPECT_EQ(format_from_filename("a." + std::string(extension)), format) << extension;
    }
  }
}

TEST(MeshFormat, WhatHoldsNoMeshIsNoMeshFormat) {
  for (const Format& format : kFormats) {
    EXPECT_EQ(format_from_name(format.name).has_value(), format.read != nullptr || format.write != nullptr)
        << format.name;
  }
}

TEST(MeshFormat, WhatIsReadIsRecognised) {
  for (const Format* format : formats_with(&Format::read)) EXPECT_NE(format->looks_like, nullptr) << format->name;
}

TEST(MeshFormat, ListsReadAsASentence) {
  const Format &a = format_row(MeshFormat::kObj), &b = format_row(MeshFormat::kGltf), &c = format_row(MeshFormat::kStl);
  EXPECT_EQ(name_list({}), "");
  EXPECT_EQ(name_list({&a}), "obj");
  EXPECT_EQ(name_list({&a, &b}), "obj or gltf");
  EXPECT_EQ(title_list({&a, &b, &c}, "and"), "OBJ, glTF and STL");
}

TEST(MeshFormat, NamesAreExact) {
  EXPECT_EQ(format_from_name("OBJ"), std::nullopt);
  EXPECT_EQ(format_from_name(""), std::nullopt);
  EXPECT_EQ(format_from_name("3ds"), std::nullopt);
}

TEST(MeshFormat, OnlyTheExtensionOfTheLastComponentCounts) {
  EXPECT_EQ(format_from_filename("Part.OBJ"), MeshFormat::kObj);
  EXPECT_EQ(format_from_filename("scans.ply/part.stl"), MeshFormat::kStl);
  EXPECT_EQ(format_from_filename("C:\\scans.ply\\part.Off"), MeshFormat::kOff);
  EXPECT_EQ(format_from_filename("scans.ply/part"), std::nullopt);
  EXPECT_EQ(format_from_filename("part.obj.gz"), std::nullopt);
  EXPECT_EQ(format_from_filename("obj"), std::nullopt);
  EXPECT_EQ(format_from_filename(""), std::nullopt);
}

TEST(MeshFormat, MediaTypesIgnoreCaseAndParameters) {
  EXPECT_EQ(format_from_media_type("Model/OBJ; charset=utf-8"), MeshFormat::kObj);
  EXPECT_EQ(format_from_media_type(" model/gltf-binary "), MeshFormat::kGlb);
  EXPECT_EQ(format_from_media_type("application/octet-stream"), std::nullopt);
  EXPECT_EQ(format_from_media_type("text/html"), std::nullopt);
  EXPECT_EQ(format_from_media_type(""), std::nullopt);
}

TEST(MeshFormat, TextIsRecognisedAfterCommentsAndByteOrderMark) {
  EXPECT_EQ(sniff_format("# made by hand\n\n  v 0 0 0\n"), MeshFormat::kObj);
  EXPECT_EQ(sniff_format("\xef\xbb\xbfmtllib a.mtl\n"), MeshFormat::kObj);
  EXPECT_EQ(sniff_format("# made by hand\nOFF\n0 0 0\n"), MeshFormat::kOff);
  EXPECT_EQ(sniff_format("STCNOFF 0 0 0"), MeshFormat::kOff);
  EXPECT_EQ(sniff_format("  SOLID part\n"), MeshFormat::kStl);
  EXPECT_EQ(sniff_format("ply\r\nformat ascii 1.0\r\n"), MeshFormat::kPly);
  EXPECT_EQ(sniff_format(R"( {"asset": {"version": "2.0"}})"), MeshFormat::kGltf);
  EXPECT_EQ(sniff_format(R"({"positions": []})"), MeshFormat::kJson);
}

TEST(MeshFormat, ABinaryStlIsRecognisedWhateverItsHeaderSays) {
  for (const std::string head : {"sample", "solid sample", "ply", "OFF", "# v 0 0 0", "v 0 0 0"}) {
    EXPECT_EQ(sniff_format(stl_binary_file(sample_mesh(), head)), MeshFormat::kStl) << head;
  }
  EXPECT_EQ(sniff_format(stl_binary_file(sample_mesh()) + "more"), MeshFormat::kStl);
}

TEST(MeshFormat, UnrecognisableBytesAreNotGuessed) {
  EXPECT_EQ(sniff_format(""), std::nullopt);
  EXPECT_EQ(sniff_format(" \n\t"), std::nullopt);
  EXPECT_EQ(sniff_format("# only a comment"), std::nullopt);
  EXPECT_EQ(sniff_format("<html><body>v 0 0 0</body></html>"), std::nullopt);
  EXPECT_EQ(sniff_format("\x1f\x8b\x08"), std::nullopt);
  EXPECT_EQ(sniff_format(std::string(200, '\0')), std::nullopt);
}

}  // namespace
}  // namespace crease::test
