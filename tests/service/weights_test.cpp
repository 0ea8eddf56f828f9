#include "crease/v1/job.pb.h"
#include "tests/service/service_fixture.h"

namespace crease::test {
namespace {

class Weights : public ServiceTest {
 protected:
  static std::size_t vertices() { return cube(4).positions.size(); }
  static nlohmann::json uneven() {
    nlohmann::json weights = nlohmann::json::array();
    for (std::size_t v = 0; v < vertices(); ++v) weights.push_back(2 * v < vertices() ? 0.1 : 30);
    return weights;
  }
  static RawResponse post(const std::string& weights, const Headers& headers = {}) {
    return post_form(port(), "/v1/jobs?sweeps=10", {{"weights", weights, "", ""}, {"mesh", small_obj(), "a.obj", ""}},
                     headers);
  }
  static std::string mesh_after(const RawResponse& submitted) {
    EXPECT_EQ(submitted.status, 202) << submitted.body;
    const auto job = server().wait_for_end(submitted.json()["id"]);
    EXPECT_EQ(job["state"], "succeeded") << job;
    return call("GET", path_of(job) + "/mesh?format=obj").body;
  }
};

TEST_F(Weights, InAFormOrAMessageChangeTheResult) {
  const auto plain = call("POST", "/v1/jobs?sweeps=10&name=a.obj", {{"Content-Type", "model/obj"}}, small_obj());
  const auto form = post(uneven().dump()), spaced = post(uneven().dump(2));
  v1::SubmitJobRequest message;
  message.set_name("a.obj");
  message.set_mesh(small_obj());
  message.mutable_parameters()->set_sweeps(10);
  for (const double weight : uneven()) message.add_weights(weight);
  const auto protobuf =
      call("POST", "/v1/jobs", {{"Content-Type", "application/x-protobuf"}}, message.SerializeAsString());
  const std::string mesh = mesh_after(form);
  EXPECT_EQ(mesh_after(protobuf), mesh);
  EXPECT_EQ(mesh_after(spaced), mesh);
  EXPECT_NE(mesh_after(plain), mesh);
  EXPECT_EQ(mesh_after(post(nlohmann::json(std::vector<double>(vertices(), 1)).dump())), mesh_after(plain));

  const std::string id = form.json()["id"], digest = form.json()["input"]["weights_sha256"];
  EXPECT_EQ(digest.size(), 64U);
  EXPECT_EQ(protobuf.json()["input"]["weights_sha256"], digest);
  EXPECT_EQ(protobuf.json()["id"].get<std::string>().substr(0, 20), id.substr(0, 20));
  EXPECT_EQ(plain.json()["input"]["weights_sha256"], "");
  EXPECT_NE(plain.json()["id"].get<std::string>().substr(0, 20), id.substr(0, 20));
}

TEST_F(Weights, AreRefusedWithFieldIndexValueAndExpectation) {
  nlohmann::json negative = uneven();
  negative[5] = -1;
  const auto problem = post(negative.dump()).json();
  EXPECT_EQ(problem["status"], 422);
  EXPECT_EQ(problem["code"], "weights_invalid");
  EXPECT_EQ(problem["field"], "weights[5]");
  EXPECT_EQ(problem["value"], "-1");
  EXPECT_EQ(problem["expected"], "a number from 0 to 1000000");
  nlohmann::json longer = uneven(), huge = uneven(), text = uneven();
  longer.push_back(1);
  huge[0] = 1e300;
  text[3] = "x";
  const std::string nan = "[NaN" + std::string(2 * (vertices() - 1), ' ') + "]";
  for (const std::string& weights :
       {std::string(), std::string("x"), std::string("[]"), std::string("[1, 2]"), std::string("[[1]]"), nan,
        longer.dump(), huge.dump(), text.dump(), std::string(1'000'000, '[')}) {
    EXPECT_EQ(post(weights).code(), "weights_invalid") << weights.substr(0, 80);
  }
}

TEST_F(Weights, InMessagesAreCheckedToo) {
  v1::SubmitJobRequest message;
  message.set_mesh(small_obj());
  const auto code = [&] {
    return call("POST", "/v1/jobs?name=a.obj", {{"Content-Type", "application/x-protobuf"}},
                message.SerializeAsString())
        .code();
  };
  message.add_weights(1);
  EXPECT_EQ(code(), "weights_invalid");
  message.set_weights(0, std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(code(), "weights_invalid");
  const std::string odd = std::string("\x1a\x03") + "off" + "\x2a\x03" + "abc";
  EXPECT_EQ(call("POST", "/v1/jobs", {{"Content-Type", "application/x-protobuf"}}, odd).code(), "protobuf_invalid");
}

TEST_F(Weights, ArePartOfAnIdempotentRequest) {
  const Headers key = {{"Idempotency-Key", "weights-1"}};
  const auto first = post(uneven().dump(), key);
  EXPECT_EQ(post(uneven().dump(), key).json()["id"], first.json()["id"]);
  nlohmann::json other = uneven();
  other[0] = 2;
  EXPECT_EQ(post(other.dump(), key).code(), "idempotency_conflict");
}

TEST_F(Weights, AreStoredWithTheJobForItsNextAttempt) {
  const auto job = post(uneven().dump()).json();
  const auto file = server().data_dir() / "jobs" / job["id"].get<std::string>() / "weights.json";
  EXPECT_EQ(nlohmann::json::parse(read_file(file)), uneven());
  server().wait_for_end(job["id"]);
  EXPECT_EQ(call("DELETE", path_of(job)).status, 204);
  EXPECT_FALSE(std::filesystem::exists(file));
  const auto refused = post("[1]");
  EXPECT_EQ(refused.status, 422);
  EXPECT_TRUE(eventually([&] { return std::filesystem::is_empty(server().data_dir() / "incoming"); }));
}

TEST_F(Weights, InAPartOverrideThoseInTheMesh) {
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "property float weight\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n"
      "0 0 0 1\n1 0 0 2\n0 1 0 3\n0 0 1 4\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";
  const auto alone = call("POST", "/v1/jobs?sweeps=1&name=a.ply", {{"Content-Type", "application/x-ply"}}, ply);
  EXPECT_EQ(alone.json()["input"]["weights_sha256"].get<std::string>().size(), 64U);
  const auto both =
      post_form(port(), "/v1/jobs?sweeps=1", {{"mesh", ply, "a.ply", ""}, {"weights", "[4, 3, 2, 1]", "", ""}});
  ASSERT_EQ(both.status, 202) << both.body;
  EXPECT_NE(both.json()["input"]["weights_sha256"], alone.json()["input"]["weights_sha256"]);
  EXPECT_NE(both.body.find("weights_replaced"), std::string::npos);
  EXPECT_EQ(server().wait_for_end(both.json()["id"])["state"], "succeeded");
}

}  // namespace
}  // namespace crease::test
