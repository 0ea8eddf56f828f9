#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "core/io/decode.h"

// Small files of every format, written by simple code that shares nothing with the readers under test.
namespace crease::test {

/// `value` as bytes in the given order.
template <typename Number>
void append(std::string& out, Number value, bool big_endian = false) {
  std::array<char, sizeof(Number)> raw{};
  std::memcpy(raw.data(), &value, sizeof(Number));
  if (big_endian != (std::endian::native == std::endian::big)) std::reverse(raw.begin(), raw.end());
  out.append(raw.data(), raw.size());
}

inline std::string join(const std::vector<std::string>& lines, const std::string& line_end = "\n") {
  std::string out;
  for (const std::string& line : lines) out += line + line_end;
  return out;
}

inline std::string xyz(const Vec3& p) { return fmt::format("{} {} {}", p.x(), p.y(), p.z()); }

inline void append_floats(std::string& out, const Vec3& p, bool big_endian = false) {
  for (int k = 0; k < 3; ++k) append(out, static_cast<float>(p[k]), big_endian);
}

/// The mesh with its coordinates rounded to float, the only precision of several formats.
inline Mesh in_single_precision(Mesh mesh) {
  for (Vec3& p : mesh.positions) {
    for (double& coordinate : p) {
      const volatile auto single =
          static_cast<float>(coordinate);  // without volatile, gcc 12 at -O3 drops the rounding
      coordinate = static_cast<double>(single);
    }
  }
  return mesh;
}

/// A tetrahedron with a hole and one isolated vertex.
inline Mesh sample_mesh() {
  return {{{0, 0, 0}, {1, 0, 0}, {0.25, 1, 0}, {0.5, 0.25, -1.5}, {3, 4, 5}}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}}};
}

/// The same without the isolated vertex, which STL cannot store.
inline Mesh connected_sample() {
  Mesh mesh = sample_mesh();
  mesh.positions.pop_back();
  return mesh;
}

inline std::string obj_file(const Mesh& mesh) {
  std::string out = "# sample\n";
  for (const Vec3& p : mesh.positions) out += "v " + xyz(p) + "\n";
  for (const Triangle& t : mesh.triangles) out += fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  return out;
}

inline std::string off_file(const Mesh& mesh) {
  std::string out = fmt::format("OFF\n{} {} 0\n", mesh.positions.size(), mesh.triangles.size());
  for (const Vec3& p : mesh.positions) out += xyz(p) + "\n";
  for (const Triangle& t : mesh.triangles) out += fmt::format("3 {} {} {}\n", t[0], t[1], t[2]);
  return out;
}

inline std::string ply_header(const Mesh& mesh, const std::string& format) {
  return join({"ply", "format " + format + " 1.0", fmt::format("element vertex {}", mesh.positions.size()),
               "property float x", "property float y", "property float z",
               fmt::format("element face {}", mesh.triangles.size()), "property list uchar int vertex_indices",
               "end_header"});
}

inline std::string ply_ascii_file(const Mesh& mesh) {
  std::string out = ply_header(mesh, "ascii");
  for (const Vec3& p : mesh.positions) out += xyz(p) + "\n";
  for (const Triangle& t : mesh.triangles) out += fmt::format("3 {} {} {}\n", t[0], t[1], t[2]);
  return out;
}

inline std::string ply_binary_file(const Mesh& mesh, bool big_endian) {
  std::string out = ply_header(mesh, big_endian ? "binary_big_endian" : "binary_little_endian");
  for (const Vec3& p : mesh.positions) append_floats(out, p, big_endian);
  for (const Triangle& t : mesh.triangles) {
    append(out, std::uint8_t{3});
    for (const Index corner : t) append(out, corner, big_endian);
  }
  return out;
}

inline std::string stl_ascii_file(const Mesh& mesh) {
  std::string out = "solid sample part\n";
  for (const Triangle& t : mesh.triangles) {
    out += "  facet normal 0 0 0\n    outer loop\n";
    for (const Index corner : t) out += "      vertex " + xyz(mesh.positions[corner]) + "\n";
    out += "    endloop\n  endfacet\n";
  }
  return out + "endsolid sample part\n";
}

inline std::string stl_binary_file(const Mesh& mesh, const std::string& head = "sample") {
  std::string out = head;
  out.resize(80, '\0');
  append(out, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const Triangle& t : mesh.triangles) {
    append_floats(out, Vec3::Zero());
    for (const Index corner : t) append_floats(out, mesh.positions[corner]);
    append(out, std::uint16_t{0});
  }
  return out;
}

inline std::string base64(const std::string& bytes) {
  const std::string alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      bits = bits << 8U | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      out += i + k <= bytes.size() ? alphabet[bits >> (18 - 6 * k) & 63U] : '=';
    }
  }
  return out;
}

/// A glTF file with one mesh, as JSON and binary buffer, so that tests can change it before it is packed.
// NOLINTNEXTLINE(bugprone-exception-escape): JSON moves without throwing.
struct GltfSample {
  nlohmann::json json;
  std::string buffer;

  /// Appends data with a new accessor and returns its index.
  std::size_t add(const std::string& data, int component, const std::string& type, std::size_t count) {
    json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", buffer.size()}, {"byteLength", data.size()}});
    json["accessors"].push_back({{"bufferView", json["bufferViews"].size() - 1},
                                 {"componentType", component},
                                 {"type", type},
                                 {"count", count}});
    buffer += data;
    buffer.resize((buffer.size() + 3) / 4 * 4, '\0');
    json["buffers"][0]["byteLength"] = buffer.size();
    return json["accessors"].size() - 1;
  }

  std::size_t add_positions(const std::vector<Vec3>& positions) {
    std::string data;
    for (const Vec3& p : positions) append_floats(data, p);
    return add(data, 5126, "VEC3", positions.size());
  }

  template <typename Number>
  std::size_t add_scalars(const std::vector<Number>& values, int component) {
    std::string data;
    for (const Number value : values) append(data, value);
    return add(data, component, "SCALAR", values.size());
  }

  nlohmann::json& primitive(std::size_t index = 0) { return json["meshes"][0]["primitives"][index]; }

  std::string glb() const {
    std::string text = json.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::string out = "glTF";
    append(out, std::uint32_t{2});
    append(out, static_cast<std::uint32_t>(28 + text.size() + buffer.size()));
    append(out, static_cast<std::uint32_t>(text.size()));
    out += "JSON" + text;
    append(out, static_cast<std::uint32_t>(buffer.size()));
    return out + std::string("BIN\0", 4) + buffer;
  }

  std::string gltf() const {
    nlohmann::json embedded = json;
    embedded["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64(buffer);
    return embedded.dump(1);
  }
};

inline GltfSample gltf_sample(const Mesh& mesh) {
  GltfSample sample;
  sample.json = {{"asset", {{"version", "2.0"}}},
                 {"buffers", nlohmann::json::array({nlohmann::json::object()})},
                 {"scene", 0},
                 {"scenes", {{{"nodes", {0}}}}},
                 {"nodes", {{{"mesh", 0}}}},
                 {"meshes", {{{"primitives", nlohmann::json::array({nlohmann::json::object()})}}}}};
  std::vector<std::uint32_t> corners;
  for (const Triangle& t : mesh.triangles) corners.insert(corners.end(), t.begin(), t.end());
  sample.primitive()["attributes"]["POSITION"] = sample.add_positions(mesh.positions);
  sample.primitive()["indices"] = sample.add_scalars(corners, 5125);
  return sample;
}

struct SampleFile {
  std::string name;
  MeshFormat format;
  std::string bytes;
};

inline void PrintTo(const SampleFile& file, std::ostream* out) { *out << file.name; }

/// One file of every kind, all with the same mesh.
inline std::vector<SampleFile> sample_files(const Mesh& mesh) {
  return {{"obj", MeshFormat::kObj, obj_file(mesh)},
          {"off", MeshFormat::kOff, off_file(mesh)},
          {"ply_ascii", MeshFormat::kPly, ply_ascii_file(mesh)},
          {"ply_little_endian", MeshFormat::kPly, ply_binary_file(mesh, false)},
          {"ply_big_endian", MeshFormat::kPly, ply_binary_file(mesh, true)},
          {"stl_ascii", MeshFormat::kStl, stl_ascii_file(mesh)},
          {"stl_binary", MeshFormat::kStl, stl_binary_file(mesh)},
          {"gltf", MeshFormat::kGltf, gltf_sample(mesh).gltf()},
          {"glb", MeshFormat::kGlb, gltf_sample(mesh).glb()}};
}

/// The error of decoding `bytes`, or nullopt when they are a valid mesh.
inline std::optional<Error> refusal(std::string_view bytes, std::optional<MeshFormat> format = std::nullopt,
                                    const DecodeLimits& limits = {}) {
  try {
    decode_mesh(bytes, format, limits);
    return std::nullopt;
  } catch (const Error& error) {
    return error;
  }
}

/// The detail of the warning with this code; empty when there is none.
inline std::string warning(const DecodedMesh& decoded, std::string_view code) {
  for (const Warning& warning : decoded.warnings) {
    if (warning.code == code) return warning.detail;
  }
  return {};
}

}  // namespace crease::test
