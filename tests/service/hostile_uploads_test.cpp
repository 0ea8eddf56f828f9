#include <cmath>
#include <limits>
#include <random>
#include <set>

#include "core/io/formats.h"
#include "proto/error_table.h"
#include "tests/service/service_fixture.h"
#include "tests/unit/decode_samples.h"

namespace crease::test {
namespace {

struct Hostile {
  std::string name, bytes, query;
};

Mesh victim() { return cube(2); }

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

std::string format_of(const SampleFile& sample) { return "format=" + std::string(format_name(sample.format)); }

/// An OBJ with its faces first, so that a truncated file lacks vertices.
std::string obj_faces_first(const Mesh& mesh) {
  std::string faces, vertices;
  for (const Triangle& t : mesh.triangles) faces += fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  for (const Vec3& p : mesh.positions) vertices += "v " + xyz(p) + "\n";
  return faces + vertices;
}

void add_truncated(std::vector<Hostile>& all) {
  for (const auto& sample : sample_files(victim())) {
    const std::string bytes = sample.format == MeshFormat::kObj ? obj_faces_first(victim()) : sample.bytes;
    // The end of a text may not matter: the last line break, or "endsolid".
    const std::size_t last = sample.name == "stl_ascii" ? bytes.rfind("endloop") : bytes.size() - 4;
    for (std::size_t cut = 1; cut <= 12; ++cut) {
      all.push_back(
          {fmt::format("{} cut at {}/12", sample.name, cut), bytes.substr(0, last * cut / 12), format_of(sample)});
    }
  }
}

void add_wrong_formats(std::vector<Hostile>& all) {
  const auto samples = sample_files(victim());
  for (const auto& sample : samples) {
    for (const auto& other : samples) {
      const bool both_gltf = sample.name.starts_with("gl") && other.name.starts_with("gl");
      if (both_gltf || sample.format == other.format || sample.name == "ply_big_endian" || other.name == "ply_ascii")
        continue;
      all.push_back({sample.name + " as " + other.name, sample.bytes, format_of(other)});
    }
  }
}

void add_wrong_counts(std::vector<Hostile>& all) {
  const Mesh mesh = victim();
  const std::string counts = fmt::format("{} {} 0", mesh.positions.size(), mesh.triangles.size());
  for (const std::string lie :
       {"4294967295 48 0", "26 4294967295 0", "99999999999999999999 48 0", "-1 48 0", "26 -48 0", "27 48 0", "26 49 0",
        "x y z", "1e9 1e9 0", "26", "0 0 0", "19999999 19999999 0"}) {
    all.push_back({"off with " + lie, replaced(off_file(mesh), counts, lie), "format=off"});
  }
  for (const bool binary : {false, true}) {
    const std::string ply = binary ? ply_binary_file(mesh, false) : ply_ascii_file(mesh);
    for (const std::string lie : {"4294967295", "99999999999999999999", "-1", "27", "x", "19999999", "0"}) {
      if (lie == "27" && binary) continue;  // then the first face is one of few corners
      all.push_back({"ply vertices " + lie, replaced(ply, "element vertex 26", "element vertex " + lie), "format=ply"});
      if (lie == "0" || lie == "27") continue;
      all.push_back({"ply faces " + lie, replaced(ply, "element face 48", "element face " + lie), "format=ply"});
    }
    all.push_back({"ply of strings", replaced(ply, "property float x", "property string x"), "format=ply"});
    all.push_back({"ply without x", replaced(ply, "property float x", "property float w"), "format=ply"});
    all.push_back({"ply without end of header", replaced(ply, "end_header", "end_headr"), "format=ply"});
  }
  for (const std::uint32_t lie : {49U, 0xffffffffU, 0x7fffffffU, 19'999'999U}) {
    std::string stl = stl_binary_file(mesh), count;
    append(count, lie);
    all.push_back({fmt::format("stl of {} facets", lie), stl.replace(80, 4, count), "format=stl"});
  }
}

void add_bad_numbers(std::vector<Hostile>& all) {
  for (const std::string bad : {"nan", "inf", "-inf", "1e999", "0x10", "1,5", "", "--1", "1e", "\x00\x01"}) {
    all.push_back({"obj with " + bad, "v 0 0 " + bad + "\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "format=obj"});
    all.push_back({"off with " + bad, "OFF\n3 1 0\n0 0 " + bad + "\n1 0 0\n0 1 0\n3 0 1 2\n", "format=off"});
  }
  for (const std::string bad : {"0", "4", "-4", "99999999999999999999", "1.5", "x", "1//9x"}) {
    all.push_back({"obj naming " + bad, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 " + bad + "\n", "format=obj"});
  }
  for (const std::string bad : {"3", "-1", "4294967295", "99999999999999999999"}) {
    all.push_back({"off naming " + bad, "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 " + bad + "\n", "format=off"});
  }
  for (const std::string corners : {"2 0 1", "1 0", "0", "-3 0 1 2", "4000000000 0 1 2"}) {
    all.push_back({"off polygon " + corners, "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n" + corners + "\n", "format=off"});
  }
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  for (const float bad : {nan, infinity, -infinity}) {
    Mesh mesh = victim();
    mesh.positions[7].y() = bad;
    for (const auto& sample : sample_files(mesh)) {
      all.push_back({fmt::format("{} with {}", sample.name, bad), sample.bytes, format_of(sample)});
    }
  }
}

void add_bent_gltf(std::vector<Hostile>& all) {
  const auto bend = [&](const std::string& name, const std::function<void(GltfSample&)>& change) {
    GltfSample sample = gltf_sample(victim());
    change(sample);
    all.push_back({"glb " + name, sample.glb(), "format=glb"});
  };
  for (const std::int64_t count : {-1LL, 27LL, 4'294'967'295LL, 1'000'000'000'000'000LL}) {
    bend(fmt::format("of {} vertices", count), [&](GltfSample& s) { s.json["accessors"][0]["count"] = count; });
    if (count == 27) continue;  // as a smaller count or another offset, this gives a valid mesh
    bend(fmt::format("of {} corners", 3 * count), [&](GltfSample& s) { s.json["accessors"][1]["count"] = 3 * count; });
    bend(fmt::format("view at {}", count), [&](GltfSample& s) { s.json["bufferViews"][0]["byteOffset"] = 16 * count; });
    bend(fmt::format("view of {}", count), [&](GltfSample& s) { s.json["bufferViews"][0]["byteLength"] = 64 * count; });
    bend(fmt::format("accessor {}", count), [&](GltfSample& s) { s.primitive()["indices"] = count; });
    bend(fmt::format("buffer of {}", count), [&](GltfSample& s) { s.json["buffers"][0]["byteLength"] = 4096 * count; });
  }
  // A sparse accessor of zeros, which the file need not contain: the zip bomb of GLB.
  bend("zip bomb of vertices", [](GltfSample& s) {
    s.json["accessors"][0].erase("bufferView");
    s.json["accessors"][0]["count"] = 1'900'000'000;
  });
  bend("zip bomb of corners", [](GltfSample& s) {
    s.json["accessors"][1].erase("bufferView");
    s.json["accessors"][1]["count"] = 2'000'000'001;
  });
  bend("sparse", [](GltfSample& s) { s.json["accessors"][0]["sparse"] = {{"count", 2'000'000'000}}; });
  bend("elsewhere", [](GltfSample& s) { s.json["buffers"][0]["uri"] = "file:///etc/passwd"; });
  bend("upwards", [](GltfSample& s) { s.json["buffers"][0]["uri"] = "../../../../etc/passwd"; });
  bend("in circles", [](GltfSample& s) { s.json["nodes"][0]["children"] = {0}; });
  bend("without buffers", [](GltfSample& s) { s.json.erase("buffers"); });
  bend("of text", [](GltfSample& s) { s.json["accessors"] = "none"; });
  bend("of lines", [](GltfSample& s) { s.primitive()["mode"] = 1; });
  std::string deep = R"({"asset":{"version":"2.0"},"extras":)";
  for (const std::size_t depth : {1'000U, 1'000'000U}) {
    all.push_back({fmt::format("gltf {} deep", depth), deep + std::string(depth, '['), "format=gltf"});
    all.push_back({fmt::format("gltf {} objects deep", depth),
                   deep +
                       [&] {
                         std::string nested;
                         for (std::size_t i = 0; i < depth; ++i) nested += "{\"a\":";
                         return nested;
                       }(),
                   "format=gltf"});
  }
}

void add_nonsense(std::vector<Hostile>& all) {
  const auto add = [&](const std::string& name, const std::string& bytes) {
    for (const Format* row : formats_with(&Format::read)) {
      const std::string format(row->name);
      all.push_back({fmt::format("{} as {}", name, format), bytes, "format=" + format});
    }
    all.push_back({name + " as anything", bytes, ""});
  };
  add("a blank", " ");
  add("line breaks", std::string(1'000, '\n'));
  add("zeros", std::string(100'000, '\0'));
  add("one long line", std::string(1'000'000, 'v'));
  add("gzip", std::string("\x1f\x8b\x08\x00", 4) + std::string(2'000, '\x55'));
  std::mt19937 engine(7);
  std::uniform_int_distribution<int> byte(0, 255);
  std::string noise;
  for (int i = 0; i < 20'000; ++i) noise += static_cast<char>(byte(engine));
  add("noise", noise);
  const std::string faceless = "v 0 0 0\nv 1 0 0\n";
  all.push_back({"no faces", faceless, "format=obj"});
  all.push_back({"no extent", "v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n", "format=obj"});
}

std::vector<Hostile> hostile_uploads() {
  std::vector<Hostile> all;
  add_truncated(all);
  add_wrong_formats(all);
  add_wrong_counts(all);
  add_bad_numbers(all);
  add_bent_gltf(all);
  add_nonsense(all);
  return all;
}

class HostileUploads : public ServiceTest {};

TEST_F(HostileUploads, AreRefusedWithACodeAndTheServiceContinues) {
  std::set<std::string_view> known;
  for (const auto& kind : error_table()) known.insert(kind.name);
  const auto uploads = hostile_uploads();
  ASSERT_GE(uploads.size(), 200U);
  RecordProperty("uploads", static_cast<int>(uploads.size()));
  std::set<std::string> met;
  for (const auto& upload : uploads) {
    SCOPED_TRACE(upload.name);
    const auto response = call("POST", "/v1/jobs?sweeps=1" + (upload.query.empty() ? "" : "&" + upload.query),
                               {{"Content-Type", "application/octet-stream"}}, upload.bytes);
    EXPECT_GE(response.status, 400) << response.body;
    EXPECT_LT(response.status, 500) << response.body;
    EXPECT_FALSE(response.code().empty()) << response.body;
    if (response.code().empty()) continue;
    EXPECT_EQ(known.count(response.code()), 1U) << response.code();
    EXPECT_FALSE(response.json()["detail"].get<std::string>().empty());
    met.insert(response.code());
  }
  for (const std::string code : {"mesh_truncated", "mesh_syntax", "mesh_index_out_of_range", "mesh_not_finite",
                                 "mesh_no_faces", "mesh_no_extent", "mesh_too_large", "mesh_format_unknown"}) {
    EXPECT_EQ(met.count(code), 1U) << code;
  }
  EXPECT_TRUE(call("GET", "/v1/jobs").json()["jobs"].empty()) << "none of them became a job";
  EXPECT_EQ(finished_job()["state"], "succeeded");
}

TEST_F(HostileUploads, AreRefusedWithThePlaceOfTheFirstFault) {
  const Headers obj = {{"Content-Type", "model/obj"}};
  const auto problem = call("POST", "/v1/jobs", obj, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n").json();
  EXPECT_EQ(problem["code"], "mesh_index_out_of_range");
  EXPECT_EQ(problem["place"], "face 0");
  EXPECT_NE(problem["detail"].get<std::string>().find("line 4"), std::string::npos) << problem;
  const auto not_finite = call("POST", "/v1/jobs", obj, "v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n").json();
  EXPECT_NE(not_finite["place"].get<std::string>().find('2'), std::string::npos) << not_finite;
}

TEST_F(HostileUploads, OverTheLimitsOfTheServerAreTooLarge) {
  ServerProcess small({"--workers", "0", "--max-faces", "100", "--max-vertices", "60", "--max-connections", "16",
                       "--max-streams", "4"});
  const auto response = exchange(small.port(), "POST", "/v1/jobs", {{"Content-Type", "model/obj"}}, small_obj());
  EXPECT_EQ(response.status, 413);
  EXPECT_EQ(response.code(), "mesh_too_large");
}

}  // namespace
}  // namespace crease::test
