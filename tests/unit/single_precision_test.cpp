#include <gtest/gtest.h>

#include <optional>

#include "core/job.h"
#include "core/measure/noise.h"
#include "tests/support/meshes.h"
#include "tests/unit/decode_samples.h"

namespace crease {
namespace {

constexpr std::string_view kCode = "single_precision_rounds";

/// A noisy cube of edges of 0.25, at coordinates as of a map, and at the origin.
Mesh noisy_cube(const Vec3& at) {
  Mesh mesh = add_noise(test::cube(4), 0.1, 2, NoiseKind::kGaussian);
  for (Vec3& position : mesh.positions) position += at;
  return mesh;
}

/// The mesh in every format that can hold it; glTF has the offset in its node.
std::vector<test::SampleFile> uploads(const Vec3& at) {
  const Mesh mesh = noisy_cube(at);
  test::GltfSample gltf = test::gltf_sample(noisy_cube(Vec3::Zero()));
  gltf.json["nodes"][0]["translation"] = {at.x(), at.y(), at.z()};
  const auto exact = [](const Mesh& whole, const std::string& before, const std::string& vertex, std::size_t base,
                        const std::string& face) {
    std::string text = before;
    for (const Vec3& p : whole.positions) text += fmt::format("{}{} {} {}\n", vertex, p.x(), p.y(), p.z());
    for (const Triangle& t : whole.triangles)
      text += fmt::format("{}{} {} {}\n", face, t[0] + base, t[1] + base, t[2] + base);
    return text;
  };
  std::string ply = test::ply_header(mesh, "ascii");
  for (std::size_t i = 0; (i = ply.find("float", i)) != std::string::npos;) ply.replace(i, 5, "double");
  return {{"obj", MeshFormat::kObj, exact(mesh, "", "v ", 1, "f ")},
          {"off", MeshFormat::kOff,
           exact(mesh, fmt::format("OFF\n{} {} 0\n", mesh.positions.size(), mesh.triangles.size()), "", 0, "3 ")},
          {"ply", MeshFormat::kPly, exact(mesh, ply, "", 0, "3 ")},
          {"glb", MeshFormat::kGlb, gltf.glb()}};
}

std::optional<std::string> detail_of(const std::vector<Warning>& warnings) {
  for (const Warning& warning : warnings) {
    if (warning.code == kCode) return warning.detail;
  }
  return std::nullopt;
}

JobOutput smoothed(const CheckedInput& input) {
  RunContext context;
  return run_job(input, {TaubinOptions{}, 1, 0}, context);
}

/// The largest distance of a corner of a face in the file to that of the result.
double loss_in(MeshFormat format, const LabelledMesh& result) {
  const Mesh mesh = decode_mesh(encode_mesh(result, format), format).mesh;
  double most = 0;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 off = mesh.positions[mesh.triangles[f][k]] - result.mesh.positions[result.mesh.triangles[f][k]];
      most = std::max(most, off.norm());
    }
  }
  return most;
}

TEST(SinglePrecision, OfMeshesFarAwayStlWarnsAndTheOtherFormatsKeepTheirDigits) {
  for (const test::SampleFile& upload : uploads({500'000.1, 5'000'000.2, 300.3})) {
    const CheckedInput input = check_input(upload.bytes, upload.format);
    const JobOutput output = smoothed(input);
    const std::optional<std::string> detail = detail_of(output.warnings);
    ASSERT_TRUE(detail.has_value()) << upload.name;
    double loss = 0;
    for (const Vec3& position : output.result.mesh.positions) {
      loss = std::max(loss, (position - position.cast<float>().cast<double>()).norm());
    }
    EXPECT_NE(detail->find(fmt::format("{:.3g} mean edge lengths", loss / input.facts.mean_edge_length)),
              std::string::npos)
        << *detail;
    for (const MeshFormat format : kMeshFormats) {
      if (format_row(format).read == nullptr) continue;
      SCOPED_TRACE(upload.name + " as " + std::string(format_name(format)));
      if (format == MeshFormat::kStl) {
        EXPECT_NEAR(loss_in(format, output.result), loss, 1e-9);
      } else {
        EXPECT_LT(loss_in(format, output.result), 1e-6 * input.facts.mean_edge_length);
      }
    }
  }
}

TEST(SinglePrecision, NearTheOriginNothingIsSaid) {
  for (const test::SampleFile& upload : uploads({3, 2, 1})) {
    const JobOutput output = smoothed(check_input(upload.bytes, upload.format));
    EXPECT_EQ(detail_of(output.warnings), std::nullopt) << upload.name;
  }
}

}  // namespace
}  // namespace crease
