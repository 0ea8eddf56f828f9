#include <gtest/gtest.h>

#include <random>

#include "proto/error_table.h"
#include "tests/unit/decode_samples.h"

namespace crease::test {
namespace {

constexpr DecodeLimits kLimits{1000, 1000};

/// Any bytes must give a valid mesh within the limits, or be refused with a mesh_* code and a place.
void expect_mesh_or_refusal(const std::string& bytes, std::optional<MeshFormat> format) {
  try {
    const Mesh mesh = decode_mesh(bytes, format, kLimits).mesh;
    ASSERT_FALSE(mesh.triangles.empty());
    ASSERT_LE(mesh.positions.size(), kLimits.max_vertices);
    ASSERT_LE(mesh.triangles.size(), kLimits.max_faces);
    for (const Vec3& p : mesh.positions) ASSERT_TRUE(p.allFinite());
    for (const Triangle& t : mesh.triangles) {
      for (const Index corner : t) ASSERT_LT(corner, mesh.positions.size());
    }
  } catch (const Error& error) {
    const std::string_view code = error_kind(error.code()).name;
    ASSERT_TRUE(code.starts_with("mesh_")) << code;
    ASSERT_FALSE(error.place().empty()) << code;
    ASSERT_FALSE(error.detail().empty()) << code;
  }
}

class DecodeMutation : public testing::TestWithParam<SampleFile> {};

TEST_P(DecodeMutation, EveryTruncationIsReadOrRefused) {
  const SampleFile& file = GetParam();
  for (std::size_t length = 0; length < file.bytes.size(); ++length) {
    SCOPED_TRACE(fmt::format("{} cut to {} bytes", file.name, length));
    ASSERT_NO_FATAL_FAILURE(expect_mesh_or_refusal(file.bytes.substr(0, length), file.format));
    ASSERT_NO_FATAL_FAILURE(expect_mesh_or_refusal(file.bytes.substr(0, length), std::nullopt));
  }
}

TEST_P(DecodeMutation, EveryReplacedByteIsReadOrRefused) {
  const SampleFile& file = GetParam();
  std::mt19937 generator(20101);
  for (std::size_t at = 0; at < file.bytes.size(); ++at) {
    std::string values("\0\xff\x80\n\r -0189eE./\\\"{}[]#", 22);
    for (int k = 0; k < 8; ++k) values += static_cast<char>(static_cast<unsigned char>(file.bytes[at]) ^ (1U << k));
    for (int k = 0; k < 4; ++k) values += static_cast<char>(generator() & 0xffU);
    std::string bytes = file.bytes;
    for (const char value : values) {
      bytes[at] = value;
      SCOPED_TRACE(fmt::format("{} with byte {} set to {}", file.name, at, static_cast<int>(value)));
      ASSERT_NO_FATAL_FAILURE(expect_mesh_or_refusal(bytes, file.format));
    }
  }
}

TEST_P(DecodeMutation, EveryRemovedOrRepeatedRangeIsReadOrRefused) {
  const SampleFile& file = GetParam();
  std::mt19937 generator(3);
  for (int round = 0; round < 2000; ++round) {
    const std::size_t first = generator() % file.bytes.size();
    const std::size_t length = 1 + generator() % 12;
    std::string bytes = file.bytes;
    if (round % 2 == 0) {
      bytes.erase(first, length);
    } else {
      bytes.insert(first, file.bytes.substr(first, length));
    }
    SCOPED_TRACE(fmt::format("{}, round {}", file.name, round));
    ASSERT_NO_FATAL_FAILURE(expect_mesh_or_refusal(bytes, file.format));
  }
}

TEST_P(DecodeMutation, EveryFormatReadsOrRefusesTheFilesOfAllOthers) {
  for (const MeshFormat format : kMeshFormats) {
    SCOPED_TRACE(GetParam().name + " read as " + std::string(format_name(format)));
    ASSERT_NO_FATAL_FAILURE(expect_mesh_or_refusal(GetParam().bytes, format));
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, DecodeMutation, testing::ValuesIn(sample_files(connected_sample())),
                         [](const auto& parameter) { return parameter.param.name; });

}  // namespace
}  // namespace crease::test
