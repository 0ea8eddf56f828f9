#include <sstream>

#include "core/io/decode.h"
#include "core/io/formats.h"
#include "crease/v1/result.pb.h"
#include "proto/result_formats.h"
#include "tests/service/service_fixture.h"

namespace crease::test {
namespace {

class Results : public ServiceTest {
 protected:
  static void SetUpTestSuite() {
    ServiceTest::SetUpTestSuite();
    job_ = server().wait_for_end(server().submit(small_obj(), "sweeps=3&name=my%20cube.obj")["id"]);
  }
  static std::string self() { return path_of(job_); }
  static inline nlohmann::json job_;
};

TEST_F(Results, MeshHasTheUploadsVerticesAndFacesInEveryFormat) {
  for (const Format* row : mesh_formats()) {
    const std::string format(row->name);
    SCOPED_TRACE(format);
    const auto response = call("GET", self() + "/mesh?format=" + format);
    ASSERT_EQ(response.status, 200) << response.body;
    EXPECT_EQ(response.header("content-type"), row->media_types.front());
    EXPECT_EQ(
        response.header("content-disposition"),
        fmt::format("attachment; filename=\"my_cube-smooth.{0}\"; filename*=UTF-8''my%20cube-smooth.{0}", format));
    EXPECT_EQ(response.header("content-length"), std::to_string(response.body.size()));
    if (format == "json") {
      EXPECT_TRUE(response.json().is_object());
    }
    if (row->read == nullptr) continue;
    const auto decoded = decode_mesh(response.body, format_from_name(format));
    EXPECT_EQ(decoded.mesh.triangles.size(), 192U);
    if (format == "obj" || format == "off" || format == "ply") {
      EXPECT_EQ(decoded.mesh.triangles, cube(4).triangles);
    }
  }
}

/// The lines that do not begin with `word`.
std::vector<std::string> lines_without(const std::string& text, const std::string& word) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    if (!line.starts_with(word)) lines.push_back(line);
  }
  return lines;
}

TEST_F(Results, TheOriginalIsTheUploadWithOtherPositions) {
  const std::string upload = "# from a scanner\nmtllib paint.mtl\nvt 0 0\ng one\nusemtl red\n" + small_obj();
  const auto job = server().wait_for_end(server().submit(upload, "sweeps=3&name=my%20cube.obj")["id"]);
  const auto original = call("GET", path_of(job) + "/mesh.original");
  ASSERT_EQ(original.status, 200) << original.body;
  EXPECT_EQ(original.header("content-type"), "model/obj");
  EXPECT_NE(original.header("content-disposition").find("my_cube-smooth.obj"), std::string::npos);
  EXPECT_EQ(lines_without(original.body, "v "), lines_without(upload, "v "));
  const auto plain = call("GET", path_of(job) + "/mesh.obj");
  EXPECT_EQ(decode_mesh(original.body, MeshFormat::kObj).mesh.positions,
            decode_mesh(plain.body, MeshFormat::kObj).mesh.positions);
  EXPECT_NE(original.header("etag"), plain.header("etag"));
  EXPECT_EQ(
      decode_mesh(call("GET", path_of(job) + "/mesh.original?measured=true").body, MeshFormat::kObj).mesh.positions,
      decode_mesh(upload, MeshFormat::kObj).mesh.positions);
}

TEST_F(Results, RidgesMayBeLinesOfObj) {
  const auto lines = call("GET", self() + "/mesh.obj?ridges=lines"), plain = call("GET", self() + "/mesh.obj");
  ASSERT_EQ(lines.status, 200) << lines.body;
  EXPECT_EQ(lines_without(lines.body, "l "), lines_without(plain.body, "l "));
  EXPECT_NE(lines.body.find("\nl "), std::string::npos);
  EXPECT_EQ(plain.body.find("\nl "), std::string::npos);
  const auto refused = call("GET", self() + "/mesh.ply?ridges=lines");
  EXPECT_EQ(refused.status, 400);
  EXPECT_EQ(refused.json()["code"], "parameter_invalid");
  EXPECT_EQ(refused.json()["field"], "ridges");
}

TEST_F(Results, GltfMayBeCompressedAndQuantized) {
  const auto plain = call("GET", self() + "/mesh.glb"), small = call("GET", self() + "/mesh.glb?compress=meshopt"),
             smaller = call("GET", self() + "/mesh.glb?compress=meshopt&quantized=true");
  ASSERT_EQ(small.status, 200) << small.body;
  ASSERT_EQ(smaller.status, 200) << smaller.body;
  EXPECT_LT(smaller.body.size(), small.body.size());
  EXPECT_NE(small.header("etag"), plain.header("etag"));
  EXPECT_NE(smaller.header("etag"), small.header("etag"));
  const Mesh mesh = decode_mesh(plain.body, MeshFormat::kGlb).mesh;
  EXPECT_EQ(decode_mesh(small.body, MeshFormat::kGlb).mesh.positions, mesh.positions);
  EXPECT_EQ(decode_mesh(smaller.body, MeshFormat::kGlb).mesh.triangles, mesh.triangles);
  for (const char* query : {"/mesh.obj?compress=meshopt", "/mesh.ply?quantized=true", "/mesh.original?quantized=true",
                            "/mesh.glb?compress=draco"}) {
    const auto refused = call("GET", self() + query);
    EXPECT_EQ(refused.status, 400) << query;
    EXPECT_TRUE(refused.json()["field"] == "compress" || refused.json()["field"] == "quantized") << refused.body;
  }
}

TEST_F(Results, ThePathMayEndInTheFormat) {
  const auto expect_same = [](const std::string& part, const crease::Formats& formats) {
    for (const Format* row : formats) {
      const std::string format(row->name);
      const auto named = call("GET", self() + "/" + part + "." + format);
      const auto asked = call("GET", self() + "/" + part + "?format=" + format);
      ASSERT_EQ(named.status, 200) << part << format;
      EXPECT_EQ(named.body, asked.body) << part << format;
      EXPECT_EQ(named.header("content-type"), row->media_types.front());
      EXPECT_NE(named.header("content-disposition").find("my_cube-"), std::string::npos) << part << format;
    }
  };
  expect_same("mesh", mesh_formats());
  expect_same("labels", label_formats());
  expect_same("ridges", ridge_formats());
  expect_same("report", report_formats());
  EXPECT_EQ(call("GET", self() + "/labels.csv?min=0.5").body, call("GET", self() + "/labels?format=csv&min=0.5").body);
  EXPECT_EQ(call("HEAD", self() + "/mesh.obj").status, 200);
  EXPECT_EQ(call("GET", self() + "/mesh.xyz").status, 404);
  EXPECT_EQ(call("GET", self() + "/events.json").status, 404);
  EXPECT_EQ(call("DELETE", self() + "/mesh.obj").status, 405);
  const auto twice = call("GET", self() + "/mesh.obj?format=ply");
  EXPECT_EQ(twice.status, 400);
  EXPECT_EQ(twice.code(), "parameter_invalid");
}

TEST_F(Results, FormatFollowsAccept) {
  const auto type = [](const std::string& accept) {
    return call("GET", self() + "/mesh", {{"Accept", accept}}).header("content-type");
  };
  EXPECT_EQ(call("GET", self() + "/mesh").header("content-type"), "model/gltf-binary");
  EXPECT_EQ(type("*/*"), "model/gltf-binary");
  EXPECT_EQ(type("model/obj"), "model/obj");
  EXPECT_EQ(type("model/obj;q=0.2, model/stl;q=0.9"), "model/stl");
  EXPECT_EQ(type("text/html, application/xml;q=0.9, */*;q=0.8"), "model/gltf-binary");
  EXPECT_EQ(type("model/*, model/gltf-binary;q=0"), "model/gltf+json");
  const auto none = call("GET", self() + "/mesh", {{"Accept", "image/png"}});
  EXPECT_EQ(none.status, 406);
  EXPECT_EQ(none.code(), "not_acceptable");
  EXPECT_EQ(call("GET", self() + "/mesh?format=off", {{"Accept", "image/png"}}).status, 200);
}

TEST_F(Results, AreNotSentAgainToAClientWithACurrentCopy) {
  const auto first = call("GET", self() + "/mesh");
  const std::string etag = first.header("etag");
  ASSERT_TRUE(etag.starts_with("\"") && etag.size() > 10) << etag;
  const auto same = call("GET", self() + "/mesh", {{"If-None-Match", "\"other\", W/" + etag}});
  EXPECT_EQ(same.status, 304);
  EXPECT_EQ(same.header("etag"), etag);
  EXPECT_TRUE(same.body.empty());
  EXPECT_EQ(call("GET", self() + "/mesh", {{"If-None-Match", "*"}}).status, 304);
  EXPECT_EQ(call("GET", self() + "/mesh", {{"If-None-Match", "\"other\""}}).body, first.body);
  EXPECT_NE(call("GET", self() + "/mesh?format=obj").header("etag"), etag);
}

struct RangeCase {
  std::string range;
  int status;
  std::size_t first, count;
};

TEST_F(Results, AreServedInRanges) {
  const std::string whole = call("GET", self() + "/mesh?format=obj").body;
  const std::size_t size = whole.size();
  const std::string target = self() + "/mesh?format=obj";
  for (const auto& one : std::vector<RangeCase>{{"bytes=0-9", 206, 0, 10},
                                                {"bytes=10-", 206, 10, size - 10},
                                                {"bytes=-5", 206, size - 5, 5},
                                                {"bytes=-99999999", 206, 0, size},
                                                {"bytes=5-99999999999", 206, 5, size - 5},
                                                {"bytes=0-0", 206, 0, 1},
                                                {fmt::format("bytes={}-", size - 1), 206, size - 1, 1},
                                                {"bytes=9-3", 200, 0, size},
                                                {"bytes=a-b", 200, 0, size},
                                                {"bytes=--1", 200, 0, size},
                                                {"lines=1-2", 200, 0, size},
                                                {"bytes=0-1,3-4", 200, 0, size},
                                                {"bytes=99999999999999999999999-", 200, 0, size}}) {
    SCOPED_TRACE(one.range);
    const auto response = call("GET", target, {{"Range", one.range}});
    EXPECT_EQ(response.status, one.status);
    EXPECT_EQ(response.body, whole.substr(one.first, one.count));
    EXPECT_EQ(response.header("accept-ranges"), "bytes");
    if (one.status == 206) {
      EXPECT_EQ(response.header("content-range"),
                fmt::format("bytes {}-{}/{}", one.first, one.first + one.count - 1, size));
    }
  }
  for (const std::string& range :
       {fmt::format("bytes={}-", size), fmt::format("bytes={}-{}", size, size + 5), std::string("bytes=-0")}) {
    const auto response = call("GET", target, {{"Range", range}});
    EXPECT_EQ(response.status, 416) << range;
    EXPECT_EQ(response.code(), "range_not_satisfiable");
    EXPECT_EQ(response.header("content-range"), fmt::format("bytes */{}", size));
  }
}

TEST_F(Results, AreSentWholeWhenIfRangeIsOutdated) {
  const auto whole = call("GET", self() + "/mesh");
  const auto part = [&](const std::string& tag) {
    return call("GET", self() + "/mesh", {{"Range", "bytes=0-3"}, {"If-Range", tag}});
  };
  EXPECT_EQ(part(whole.header("etag")).body, "glTF");
  EXPECT_EQ(part("\"older\"").body, whole.body);
  EXPECT_EQ(part("Wed, 21 Oct 2015 07:28:00 GMT").body, whole.body);
}

TEST_F(Results, AThousandRangesGetTheWholeFile) {
  std::string ranges = "bytes=0-";
  for (int i = 0; i < 1'500; ++i) ranges += ",0-";
  const auto response = call("GET", self() + "/mesh", {{"Range", ranges}});
  EXPECT_EQ(response.body, call("GET", self() + "/mesh").body);
}

TEST_F(Results, HeadTellsTheSizeOfTheMesh) {
  const auto head = call("HEAD", self() + "/mesh?format=obj", {{"Range", "bytes=0-3"}});
  const auto get = call("GET", self() + "/mesh?format=obj");
  EXPECT_EQ(head.status, 200);
  EXPECT_EQ(head.header("content-length"), get.header("content-length"));
  EXPECT_EQ(head.header("etag"), get.header("etag"));
  EXPECT_TRUE(head.body.empty());
}

TEST_F(Results, LabelsAreTheSameInEveryFormat) {
  const auto json = call("GET", self() + "/labels").json();
  ASSERT_EQ(json["edges"].size(), 288U);
  EXPECT_EQ(json["count"], 288);
  v1::EdgeLabels message;
  ASSERT_TRUE(message.ParseFromString(call("GET", self() + "/labels?format=pb").body));
  ASSERT_EQ(message.labels_size(), 288);
  for (int i = 0; i < message.labels_size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    EXPECT_NEAR(json["labels"][at].get<double>(), message.labels(i), 1e-6);
    EXPECT_EQ(json["edges"][at][0], message.edges(2 * i));
    EXPECT_EQ(json["edges"][at][1], message.edges(2 * i + 1));
    EXPECT_NEAR(json["dihedral_deg"][at].get<double>(), message.dihedral_deg(i), 1e-4);
  }
  const auto csv = call("GET", self() + "/labels?format=csv");
  EXPECT_EQ(csv.header("content-type"), "text/csv");
  EXPECT_TRUE(csv.body.starts_with("v0,v1,label,dihedral_deg\n"));
  EXPECT_EQ(std::count(csv.body.begin(), csv.body.end(), '\n'), 289);
}

TEST_F(Results, LabelsAreFilteredByTheirValue) {
  const auto all = call("GET", self() + "/labels").json();
  const auto some = call("GET", self() + "/labels?min=0.5").json();
  const auto expected = std::count_if(all["labels"].begin(), all["labels"].end(),
                                      [](const auto& label) { return label.template get<double>() >= 0.5; });
  EXPECT_EQ(some["count"], expected);
  EXPECT_EQ(some["threshold"], 0.5);
  for (const auto& label : some["labels"]) EXPECT_GE(label.get<double>(), 0.5);
}

TEST_F(Results, RidgesAreServedAsJsonAndGlb) {
  const auto json = call("GET", self() + "/ridges");
  ASSERT_EQ(json.status, 200) << json.body;
  EXPECT_EQ(json.header("content-type"), "application/json");
  const auto ridges = json.json();
  EXPECT_EQ(ridges["count"], job_["result"]["ridge_lines"]);
  EXPECT_EQ(ridges["ridges"].size(), ridges["count"]);
  EXPECT_EQ(ridges["corners"].size(), job_["result"]["corners"]);
  EXPECT_GT(job_["result"]["segments"], 0);
  std::size_t edges = 0;
  for (const auto& line : ridges["ridges"]) {
    edges += line["vertices"].size() - (line["closed"] ? 0 : 1);
    EXPECT_GE(line["mean_label"].get<double>(), 0.5);
  }
  EXPECT_EQ(edges, job_["result"]["ridge_edges"]);

  const auto glb = call("GET", self() + "/ridges?format=glb");
  EXPECT_EQ(glb.header("content-type"), "model/gltf-binary");
  EXPECT_TRUE(glb.body.starts_with("glTF"));
  EXPECT_EQ(call("GET", self() + "/ridges", {{"Accept", "model/gltf-binary"}}).body, glb.body);
  EXPECT_EQ(call("GET", self() + "/ridges", {{"Accept", "text/csv"}}).code(), "not_acceptable");
  EXPECT_EQ(call("GET", self() + "/ridges?format=csv").code(), "parameter_invalid");
  EXPECT_NE(glb.header("etag"), json.header("etag"));
  EXPECT_EQ(call("GET", self() + "/ridges", {{"If-None-Match", json.header("etag")}}).status, 304);
  EXPECT_EQ(call("GET", self() + "/ridges", {{"Range", "bytes=0-3"}}).body, json.body.substr(0, 4));
  EXPECT_EQ(job_["links"]["ridges"], self() + "/ridges");
}

TEST_F(Results, MeshesContainClassesAndSegments) {
  const auto mesh = call("GET", self() + "/mesh?format=json").json();
  EXPECT_EQ(mesh["classes"].size(), mesh["positions"].size());
  EXPECT_EQ(mesh["segments"].size(), mesh["triangles"].size());
  EXPECT_EQ(mesh["extras"]["counts"]["segments"], job_["result"]["segments"]);
  const std::string glb = call("GET", self() + "/mesh?format=glb").body;
  EXPECT_NE(glb.find("_CLASS"), std::string::npos);
  EXPECT_NE(glb.find("_SEGMENT"), std::string::npos);
}

TEST_F(Results, ReportContainsTheEnergyOfEverySweep) {
  const auto report = call("GET", self() + "/report").json();
  EXPECT_EQ(report["sweeps"].size(), 3U);
  for (const auto& sweep : report["sweeps"]) EXPECT_GT(sweep["energy"]["total"].get<double>(), -1e9);
  EXPECT_EQ(report["input"]["sha256"], job_["input"]["sha256"]);
  EXPECT_EQ(report["parameters"]["sweeps"], 3);
  v1::Report message;
  ASSERT_TRUE(message.ParseFromString(call("GET", self() + "/report?format=pb").body));
  EXPECT_EQ(message.sweeps_size(), 3);
}

TEST_F(Results, OfARunningJobAreRefusedExceptItsSnapshot) {
  const auto running = server().submit(obj_text(icosphere(4)), kLong);
  for (const std::string part : {"/mesh", "/labels", "/ridges", "/report"}) {
    const auto response = call("GET", path_of(running) + part);
    EXPECT_EQ(response.status, 409);
    EXPECT_EQ(response.code(), "job_not_finished");
    EXPECT_EQ(response.header("retry-after"), "1");
  }
  RawResponse snapshot;
  ASSERT_TRUE(eventually([&] {
    snapshot = call("GET", path_of(running) + "/mesh?snapshot=true&format=obj");
    EXPECT_TRUE(snapshot.status == 200 || snapshot.code() == "snapshot_unavailable") << snapshot.body;
    return snapshot.status == 200;
  }));
  EXPECT_EQ(decode_mesh(snapshot.body, MeshFormat::kObj).mesh.triangles, icosphere(4).triangles);
  const auto plain = call("GET", path_of(running) + "/mesh?snapshot=true&format=json").json();
  EXPECT_FALSE(plain.contains("classes") || plain.contains("segments"));
  EXPECT_EQ(snapshot.headers.count("etag"), 0U);
  EXPECT_EQ(snapshot.header("cache-control"), "no-store");
  call("POST", path_of(running) + "/cancel");
  EXPECT_EQ(server().wait_for_state(running["id"], "cancelled")["state"], "cancelled");
  for (const std::string part : {"/mesh", "/labels", "/ridges", "/report"}) {
    EXPECT_EQ(call("GET", path_of(running) + part).code(), "job_cancelled");
  }
  EXPECT_EQ(call("GET", self() + "/mesh?snapshot=true").body, call("GET", self() + "/mesh").body);
}

}  // namespace
}  // namespace crease::test
