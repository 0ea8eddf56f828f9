#include "crease/v1/job.pb.h"
#include "tests/service/service_fixture.h"

namespace crease::test {
namespace {

class Submit : public ServiceTest {
 protected:
  static std::string mesh_after(const RawResponse& submitted) {
    EXPECT_EQ(submitted.status, 202) << submitted.body;
    EXPECT_EQ(submitted.header("location"), path_of(submitted.json()));
    const auto job = server().wait_for_end(submitted.json()["id"]);
    EXPECT_EQ(job["state"], "succeeded") << job;
    return call("GET", path_of(job) + "/mesh?format=obj").body;
  }

  static std::string protobuf(const std::string& mesh, std::uint32_t sweeps) {
    v1::SubmitJobRequest message;
    message.set_name("cube.obj");
    message.set_mesh(mesh);
    message.mutable_parameters()->set_sweeps(sweeps);
    return message.SerializeAsString();
  }
};

TEST_F(Submit, AcceptsRawMultipartAndProtobufWithTheSameResult) {
  const auto raw = call("POST", "/v1/jobs?sweeps=3&name=cube.obj", {{"Content-Type", "model/obj"}}, small_obj());
  const auto form = post_form(port(), "/v1/jobs",
                              {{"mesh", small_obj(), "cube.obj", "application/octet-stream"},
                               {"parameters", R"({"sweeps": 3})", "", "application/json"}});
  const auto message = call("POST", "/v1/jobs", {{"Content-Type", "application/x-protobuf"}}, protobuf(small_obj(), 3));
  const std::string mesh = mesh_after(raw);
  EXPECT_GT(mesh.size(), 1000U);
  EXPECT_EQ(mesh_after(form), mesh);
  EXPECT_EQ(mesh_after(message), mesh);
  for (const auto* response : {&raw, &form, &message}) {
    const auto job = response->json();
    EXPECT_EQ(job["input"]["name"], "cube.obj");
    EXPECT_EQ(job["input"]["format"], "obj");
    EXPECT_EQ(job["input"]["bytes"], small_obj().size());
    EXPECT_EQ(job["input"]["sha256"].get<std::string>().size(), 64U);
    EXPECT_EQ(job["input"]["faces"], 192);
    EXPECT_EQ(job["parameters"]["sweeps"], 3);
    EXPECT_EQ(job["parameters"]["solver"], "metropolis");
    EXPECT_EQ(job["links"]["events"], path_of(job) + "/events");
  }
}

TEST_F(Submit, WarnsOfAParameterThatIsNotUsedInEveryForm) {
  v1::SubmitJobRequest message;
  message.ParseFromString(protobuf(small_obj(), 3));
  message.mutable_parameters()->set_diebel_weight(5);
  const std::string expected = "parameter 'diebel_weight' is '5' and is not used: it matters only with method=diebel";
  const Headers obj = {{"Content-Type", "model/obj"}}, binary = {{"Content-Type", "application/x-protobuf"}};
  const auto raw = call("POST", "/v1/jobs?sweeps=3&diebel_weight=5&name=cube.obj", obj, small_obj());
  const auto form = post_form(port(), "/v1/jobs?seed=90",
                              {{"mesh", small_obj(), "cube.obj", ""},
                               {"parameters", R"({"sweeps": 3, "diebel_weight": 5})", "", "application/json"}});
  const auto protobuf_job = call("POST", "/v1/jobs", binary, message.SerializeAsString());
  for (const auto* response : {&raw, &form, &protobuf_job}) {
    const auto job = response->json();
    ASSERT_EQ(job["warnings"].size(), 1U) << job;
    EXPECT_EQ(job["warnings"][0]["code"], "parameter_not_used");
    EXPECT_EQ(job["warnings"][0]["detail"], expected);
    EXPECT_FALSE(job["parameters"].contains("diebel_weight"));
  }
  const std::string id = form.json()["id"];
  EXPECT_EQ(server().wait_for_end(id)["warnings"][0]["detail"], expected);
  EXPECT_EQ(call("GET", "/v1/jobs/" + id + "/report").json()["warnings"][0]["detail"], expected);
}

TEST_F(Submit, ARepeatedRequestIsWarnedThoughItsJobIsThere) {
  const Headers headers = {{"Content-Type", "model/obj"}, {"Idempotency-Key", "in-vain"}};
  const auto first = call("POST", "/v1/jobs?sweeps=3&seed=91", headers, small_obj()).json();
  EXPECT_TRUE(first["warnings"].empty());
  const auto again = call("POST", "/v1/jobs?sweeps=3&seed=91&passband=0.2", headers, small_obj()).json();
  EXPECT_EQ(again["id"], first["id"]);
  ASSERT_EQ(again["warnings"].size(), 1U);
  EXPECT_EQ(again["warnings"][0]["code"], "parameter_not_used");
}

TEST_F(Submit, GuessesTheFormatFromNameThenBytes) {
  const std::string off = "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";
  const Headers plain = {{"Content-Type", "application/octet-stream"}};
  EXPECT_EQ(call("POST", "/v1/jobs?sweeps=1&name=a.off", plain, off).json()["input"]["format"], "off");
  EXPECT_EQ(call("POST", "/v1/jobs?sweeps=1&format=off", plain, off).json()["input"]["format"], "off");
  EXPECT_EQ(call("POST", "/v1/jobs?sweeps=1", plain, off).json()["input"]["format"], "off");
  EXPECT_EQ(call("POST", "/v1/jobs?sweeps=1", {}, off).json()["input"]["format"], "off");
}

TEST_F(Submit, AcceptsChunkedBodies) {
  RawConnection connection(port());
  connection.send(
      "POST /v1/jobs?sweeps=1 HTTP/1.1\r\nHost: x\r\nContent-Type: model/obj\r\n"
      "Transfer-Encoding: chunked\r\n\r\n");
  const std::string& mesh = small_obj();
  for (std::size_t at = 0; at < mesh.size(); at += 100) {
    const std::string piece = mesh.substr(at, 100);
    connection.send(fmt::format("{:x};note=1\r\n{}\r\n", piece.size(), piece));
  }
  connection.send("0\r\nTrailer: x\r\n\r\n" + raw_request("GET", "/healthz"));
  const auto response = connection.receive();
  ASSERT_EQ(response.status, 202) << response.body;
  EXPECT_EQ(response.json()["input"]["bytes"], mesh.size());
  EXPECT_EQ(connection.receive().status, 200) << "the connection stays open";
}

TEST_F(Submit, AnswersExpectContinueBeforeTheBody) {
  RawConnection connection(port());
  connection.send(
      fmt::format("POST /v1/jobs?sweeps=1 HTTP/1.1\r\nHost: x\r\nContent-Type: model/obj\r\n"
                  "Expect: 100-continue\r\nContent-Length: {}\r\n\r\n",
                  small_obj().size()));
  EXPECT_EQ(connection.receive().status, 100);
  connection.send(small_obj());
  EXPECT_EQ(connection.receive().status, 202);

  RawConnection refused(port());
  refused.send("POST /v1/jobs?nonsense=1 HTTP/1.1\r\nHost: x\r\nExpect: 100-continue\r\nContent-Length: 9\r\n\r\n");
  const auto response = refused.receive();
  EXPECT_EQ(response.code(), "parameter_unknown");
  EXPECT_EQ(response.header("connection"), "close");
}

TEST_F(Submit, MergesParametersOfQueryAndBodyButRefusesRepeatedOnes) {
  const std::vector<FormPart> parts = {{"mesh", small_obj(), "a.obj", ""}, {"parameters", R"({"sweeps": 2})", "", ""}};
  const auto job = post_form(port(), "/v1/jobs?seed=7", parts).json();
  EXPECT_EQ(job["parameters"]["sweeps"], 2);
  EXPECT_EQ(job["parameters"]["seed"], 7);
  const auto twice = post_form(port(), "/v1/jobs?sweeps=2", parts);
  EXPECT_EQ(twice.code(), "parameter_invalid");
  EXPECT_EQ(twice.json()["field"], "sweeps");
  const auto repeated = post_form(port(), "/v1/jobs", {parts[0], {"parameters", R"({"seed": 1, "seed": 2})", "", ""}});
  EXPECT_EQ(repeated.code(), "parameter_invalid");
}

TEST_F(Submit, RefusesInvalidForms) {
  const FormPart mesh = {"mesh", small_obj(), "a.obj", ""};
  EXPECT_EQ(post_form(port(), "/v1/jobs", {mesh, mesh}).code(), "multipart_invalid");
  EXPECT_EQ(post_form(port(), "/v1/jobs", {mesh, {"colour", "red", "", ""}}).code(), "multipart_part_unknown");
  EXPECT_EQ(post_form(port(), "/v1/jobs", {{"parameters", "{}", "", ""}}).code(), "multipart_part_missing");
  EXPECT_EQ(post_form(port(), "/v1/jobs", {mesh, {"parameters", "{", "", ""}}).code(), "json_invalid");
  EXPECT_EQ(post_form(port(), "/v1/jobs", {mesh, {"parameters", "[1]", "", ""}}).code(), "json_invalid");
  EXPECT_EQ(post_form(port(), "/v1/jobs", {mesh, {"parameters", R"({"sweeps":"3"})", "", ""}}).code(),
            "parameter_invalid");
  EXPECT_EQ(post_form(port(), "/v1/jobs", {mesh, {"parameters", std::string(100'000, ' '), "", ""}}).code(),
            "json_invalid");
  EXPECT_EQ(post_form(port(), "/v1/jobs", {{"mesh", "", "a.obj", ""}}).code(), "mesh_empty");
  EXPECT_EQ(post_form(port(), "/v1/jobs", {{std::string(9'000, 'n'), "x", "", ""}}).code(), "multipart_invalid");
  const std::string open = "--b\r\nContent-Disposition: form-data; name=\"mesh\"\r\n\r\n" + small_obj();
  EXPECT_EQ(call("POST", "/v1/jobs", {{"Content-Type", "multipart/form-data; boundary=b"}}, open).code(),
            "multipart_invalid");
}

TEST_F(Submit, KeepsOnlyTheLastComponentOfAFileName) {
  const auto job = post_form(port(), "/v1/jobs?sweeps=1", {{"mesh", small_obj(), "../../etc/cr\xc3\xa4zy.obj", ""}});
  EXPECT_EQ(job.json()["input"]["name"], "cr\xc3\xa4zy.obj");
}

TEST_F(Submit, WaitsForTheEndWhenAsked) {
  const Headers headers = {{"Prefer", "respond-async, wait=60"}, {"Content-Type", "model/obj"}};
  const auto ended = call("POST", "/v1/jobs?sweeps=2&seed=31", headers, small_obj());
  EXPECT_EQ(ended.status, 200);
  EXPECT_EQ(ended.json()["state"], "succeeded");
  EXPECT_EQ(ended.header("preference-applied"), "wait=60");

  const auto still =
      call("POST", "/v1/jobs?" + kLong, {{"Prefer", "wait=1"}, {"Content-Type", "model/obj"}}, obj_text(icosphere(4)));
  EXPECT_EQ(still.status, 202);
  EXPECT_EQ(still.header("preference-applied"), "wait=1");
  call("DELETE", path_of(still.json()));

  const auto capped =
      call("POST", "/v1/jobs?sweeps=1", {{"Prefer", "wait=9999"}, {"Content-Type", "model/obj"}}, small_obj());
  EXPECT_EQ(capped.header("preference-applied"), "wait=60");
}

TEST_F(Submit, RepeatsNoWorkForTheSameIdempotencyKey) {
  const Headers headers = {{"Idempotency-Key", "key-1"}, {"Content-Type", "model/obj"}};
  const auto first = call("POST", "/v1/jobs?sweeps=2", headers, small_obj());
  const auto again = call("POST", "/v1/jobs?sweeps=2", headers, small_obj());
  EXPECT_EQ(first.header("idempotent-replayed"), "");
  EXPECT_EQ(again.header("idempotent-replayed"), "true");
  EXPECT_EQ(again.json()["id"], first.json()["id"]);
  const auto other = call("POST", "/v1/jobs?sweeps=3", headers, small_obj());
  EXPECT_EQ(other.status, 422);
  EXPECT_EQ(other.code(), "idempotency_conflict");
  const auto another_mesh = call("POST", "/v1/jobs?sweeps=2", headers, obj_text(cube(3)));
  EXPECT_EQ(another_mesh.code(), "idempotency_conflict");
}

TEST_F(Submit, GivesTheSameBytesForTheSameMeshParametersAndSeed) {
  const auto mesh_of = [](const std::string& query) {
    const auto job = server().wait_for_end(server().submit(small_obj(), query)["id"]);
    return call("GET", path_of(job) + "/mesh?format=glb").body;
  };
  const std::string one = mesh_of("sweeps=5&threads=1");
  EXPECT_EQ(mesh_of("sweeps=5&threads=2"), one);
  EXPECT_NE(mesh_of("sweeps=5&seed=2"), one);
}

TEST_F(Submit, LeavesNothingOfARefusedUpload) {
  call("POST", "/v1/jobs", {{"Content-Type", "model/obj"}}, "v 0 0 nan\nf 1 1 1\n");
  RawConnection cut(port());
  cut.send("POST /v1/jobs HTTP/1.1\r\nHost: x\r\nContent-Type: model/obj\r\nContent-Length: 1000\r\n\r\nv 0 0 0\n");
  cut.close();
  const auto files = [] {
    std::size_t count = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(server().data_dir())) {
      count += entry.is_regular_file() && entry.file_size() <= 20 && entry.file_size() > 0 ? 1 : 0;
    }
    return count;
  };
  EXPECT_TRUE(eventually([&] { return files() == 0; }));
}

}  // namespace
}  // namespace crease::test
