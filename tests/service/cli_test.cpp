#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "proto/parameter_table.h"
#include "proto/result_formats.h"
#include "tests/service/service_fixture.h"

namespace crease::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

class CommandLine : public ServiceTest {
 protected:
  CommandLine() {
    write("input.obj", small_obj());
    const Finished noise = crease({"noise", path("input.obj"), "-o", path("noisy.obj"), "--sigma", "0.1"});
    EXPECT_EQ(noise.exit_code, 0) << noise.errors;
  }

  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  void write(const std::string& name, const std::string& bytes) const { std::ofstream(path(name)) << bytes; }
  std::string bytes(const std::string& name) const { return read_file(path(name)); }
  bool exists(const std::string& name) const { return fs::exists(path(name)); }
  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_.path()), fs::directory_iterator()));
  }

  static std::string url() { return "http://127.0.0.1:" + std::to_string(port()); }

  static Finished crease(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), CREASE_BIN);
    return run_program(arguments);
  }
  static Finished remote(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--server", url()});
    return crease(std::move(arguments));
  }

  /// Runs crease until it reports progress, then sends SIGTERM.
  static Finished interrupted(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), CREASE_BIN);
    Program program(arguments);
    EXPECT_TRUE(eventually([&] { return program.errors().find("sweep") != std::string::npos; }));
    program.signal(SIGTERM);
    const int exit_code = program.wait();
    return {exit_code, program.output(), program.errors()};
  }
  /// A mesh that `kLong` takes minutes for.
  std::string big() const {
    write("big.obj", obj_text(icosphere(4)));
    return path("big.obj");
  }

 private:
  TemporaryFolder folder_;
};

TEST_F(CommandLine, LocalAndHttpAndAnyNumberOfThreadsGiveTheSameBytes) {
  for (const Format* row : mesh_formats()) {
    const std::string format(row->name);
    const std::string one = "one." + format, two = "two." + format, http = "http." + format;
    const std::vector<std::string> common = {"smooth", path("noisy.obj"), "-p", "sweeps=20"};
    auto run = [&](const std::string& name, std::vector<std::string> more) {
      std::vector<std::string> all = common;
      all.insert(all.end(), {"-o", path(name), "--labels", path(name + ".labels.json")});
      all.insert(all.end(), {"--ridges", path(name + (format == "glb" ? ".ridges.glb" : ".ridges.json"))});
      all.insert(all.end(), more.begin(), more.end());
      const Finished finished = crease(all);
      ASSERT_EQ(finished.exit_code, 0) << finished.errors;
    };
    run(one, {"--local", "--threads", "1"});
    run(two, {"--local", "--threads", "2"});
    run(http, {"--server", url()});
    ASSERT_FALSE(bytes(one).empty());
    EXPECT_TRUE(bytes(one) == bytes(two)) << format;
    EXPECT_TRUE(bytes(one) == bytes(http)) << format;
    EXPECT_TRUE(bytes(one + ".labels.json") == bytes(http + ".labels.json")) << format;
    const std::string ridges = format == "glb" ? ".ridges.glb" : ".ridges.json";
    EXPECT_FALSE(bytes(one + ridges).empty());
    EXPECT_TRUE(bytes(one + ridges) == bytes(http + ridges)) << format;
  }
}

TEST_F(CommandLine, ADifferentSeedGivesADifferentMesh) {
  const auto smooth = [&](const std::string& seed) {
    EXPECT_EQ(
        crease({"smooth", path("noisy.obj"), "-o", path(seed + ".obj"), "--local", "-p", "sweeps=5", "--seed", seed})
            .exit_code,
        0);
    return bytes(seed + ".obj");
  };
  EXPECT_NE(smooth("1"), smooth("2"));
}

TEST_F(CommandLine, WeightsGiveTheSameBytesLocallyAndOverHttp) {
  const std::size_t vertices = cube(4).positions.size();
  json weights = json::array();
  for (std::size_t v = 0; v < vertices; ++v) weights.push_back(v % 2 == 0 ? 0.5 : 20);
  write("weights.json", weights.dump());
  const auto smooth = [&](const std::string& name, const std::vector<std::string>& more) {
    std::vector<std::string> all = {"smooth", path("noisy.obj"), "-o", path(name), "-p", "sweeps=20"};
    all.insert(all.end(), more.begin(), more.end());
    const Finished finished = crease(all);
    EXPECT_EQ(finished.exit_code, 0) << finished.errors;
    return bytes(name);
  };
  const std::string local = smooth("local.glb", {"--local", "--weights", path("weights.json")});
  EXPECT_TRUE(local == smooth("http.glb", {"--server", url(), "--weights", path("weights.json")}));
  EXPECT_FALSE(local == smooth("plain.glb", {"--local"}));
  const Finished submitted = remote({"submit", path("noisy.obj"), "--weights", path("weights.json"), "--json"});
  ASSERT_EQ(submitted.exit_code, 0) << submitted.errors;
  EXPECT_EQ(json::parse(submitted.output)["input"]["weights_sha256"].get<std::string>().size(), 64U);
}

TEST_F(CommandLine, SmoothPrintsOneObjectWithJson) {
  for (const std::vector<std::string>& where : {std::vector<std::string>{"--local"}, {"--server", url()}}) {
    std::vector<std::string> arguments = {"smooth",   path("noisy.obj"),  "-o",       path("out.glb"),
                                          "--labels", path("labels.csv"), "--report", path("report.json"),
                                          "-p",       "sweeps=4",         "--json"};
    arguments.insert(arguments.end(), where.begin(), where.end());
    const Finished finished = crease(arguments);
    ASSERT_EQ(finished.exit_code, 0) << finished.errors;
    const json object = json::parse(finished.output);
    EXPECT_EQ(object["job"]["state"], "succeeded");
    EXPECT_EQ(object["job"]["parameters"]["sweeps"], 4);
    EXPECT_EQ(object["job"]["input"]["name"], "noisy.obj");
    EXPECT_EQ(object["job"]["input"]["format"], "obj");
    EXPECT_EQ(object["job"]["input"]["faces"], 192);
    EXPECT_EQ(object["files"]["mesh"], path("out.glb"));
    EXPECT_THAT(bytes("labels.csv"), testing::StartsWith("v0,v1,label,dihedral_deg"));
    const json report = json::parse(bytes("report.json"));
    EXPECT_EQ(report["sweeps"].size(), 4U);
    EXPECT_EQ(report["id"], object["job"]["id"]);
  }
}

TEST_F(CommandLine, ComponentsThatStandApartHaveChoicesOfTheirOwn) {
  write("two.obj", obj_text(joined({cube(10), moved(icosphere(3), 4, Vec3(9, 0, 0))})));
  ASSERT_EQ(crease({"noise", path("two.obj"), "-o", path("two-noisy.obj"), "--sigma", "0.1"}).exit_code, 0);
  const std::vector<std::string> arguments = {"smooth", path("two-noisy.obj"), "-o", path("out.glb")};
  std::vector<std::string> as_json = arguments;
  as_json.emplace_back("--json");
  const Finished finished = remote(as_json);
  ASSERT_EQ(finished.exit_code, 0) << finished.errors;
  const json result = json::parse(finished.output)["job"]["result"];
  EXPECT_EQ(result["choice"]["faces"], 1280);
  ASSERT_EQ(result["other_choices"].size(), 1U);
  EXPECT_EQ(result["other_choices"][0]["faces"], 1200);
  std::vector<std::string> local = arguments;
  local.emplace_back("--local");
  EXPECT_THAT(crease(local).output, HasSubstr("apart, 1200 faces: noise"));
}

TEST_F(CommandLine, ProgressIsPlainLinesWhenPiped) {
  const Finished finished = crease({"smooth", path("noisy.obj"), "-o", path("out.obj"), "--local", "-p", "sweeps=200"});
  ASSERT_EQ(finished.exit_code, 0);
  const auto lines = std::ranges::count(finished.errors, '\n');
  EXPECT_GE(lines, 9);
  EXPECT_LE(lines, 13);
  EXPECT_THAT(finished.errors, HasSubstr("sweep 200/200"));
  EXPECT_THAT(finished.errors, HasSubstr("energy"));
  EXPECT_THAT(finished.errors, HasSubstr("ETA"));
  EXPECT_EQ(finished.errors.find_first_of("\r\033"), std::string::npos);
  EXPECT_THAT(finished.output, HasSubstr("displacement"));
}

TEST_F(CommandLine, QuietPrintsNothing) {
  const Finished finished =
      crease({"smooth", path("noisy.obj"), "-o", path("out.obj"), "--local", "-p", "sweeps=3", "-q"});
  EXPECT_EQ(finished.exit_code, 0);
  EXPECT_EQ(finished.output + finished.errors, "");
}

TEST_F(CommandLine, InvalidParametersAreRefusedAsByTheService) {
  const std::vector<std::pair<std::string, std::string>> cases = {{"sharpnes=1", "parameter_unknown"},
                                                                  {"sweeps=many", "parameter_invalid"},
                                                                  {"step_size=-1", "parameter_out_of_range"}};
  for (const auto& [assignment, code] : cases) {
    const Finished finished =
        crease({"smooth", path("noisy.obj"), "-o", path("out.obj"), "-p", assignment, "--local", "--json"});
    EXPECT_EQ(finished.exit_code, 2);
    const json mine = json::parse(finished.output);
    const json service = call("POST", "/v1/jobs?" + assignment, {{"Content-Type", "model/obj"}}, small_obj()).json();
    EXPECT_EQ(mine["code"], code);
    for (const char* member : {"code", "status", "title", "field", "value"}) {
      EXPECT_EQ(mine[member], service[member]) << member;
    }
    // The service also expects a name and a format in the query, so its list of known names is longer.
    const bool unknown = code == "parameter_unknown";
    EXPECT_EQ(mine["detail"] == service["detail"], !unknown);
  }
  EXPECT_FALSE(exists("out.obj"));
}

TEST_F(CommandLine, ExitCodesTellTheKindOfFailure) {
  write("broken.obj", "v 0 0 0\nf 1 2 3\n");
  write("three.json", "[1, 1, 1]");
  const std::string noisy = path("noisy.obj"), out = path("out.obj");
  const std::string broken = path("broken.obj");
  const std::vector<std::pair<std::vector<std::string>, int>> cases = {
      {{"smooth", noisy, "-o", out, "--local", "-p", "seed"}, 2},
      {{"smooth", noisy, "-o", out, "--local", "-p", "seed=1", "--seed", "2"}, 2},
      {{"smooth", noisy, "-o", path("out.xyz"), "--local"}, 2},
      {{"smooth", noisy, "-o", out, "--ridges", path("ridges.csv"), "--local"}, 2},
      {{"smooth", noisy, "-o", out, "--weights", path("three.json"), "--local"}, 3},
      {{"smooth", noisy, "-o", out, "--weights", path("three.json"), "--server", url()}, 3},
      {{"smooth", noisy, "-o", out, "--weights", path("missing.json"), "--local"}, 9},
      {{"smooth", noisy, "-o", out, "--weights", path("missing.json"), "--server", url()}, 9},
      {{"smooth", noisy}, 2},
      {{"smoothen"}, 2},
      {{}, 2},
      {{"smooth", noisy, "-o", out, "--local", "--server", url()}, 2},
      {{"smooth", broken, "-o", out, "--local"}, 3},
      {{"smooth", broken, "-o", out, "--server", url()}, 3},
      {{"smooth", noisy, "-o", out, "--server", "http://127.0.0.1:1"}, 4},
      {{"health", "--server", "127.0.0.1:1"}, 4},
      {{"status", "0123456789abcdef0123", "--server", url()}, 7},
      {{"watch", "0123456789abcdef0123", "--server", url()}, 7},
      {{"smooth", path("missing.obj"), "-o", out, "--local"}, 9},
      {{"smooth", path("missing.obj"), "-o", out, "--server", url()}, 9},
      {{"smooth", noisy, "-o", path("no/such/folder.obj"), "--local", "-p", "sweeps=1"}, 9},
      {{"noise", noisy, "-o", out, "--sigma", "-1"}, 2},
      {{"noise", noisy, "-o", out, "--sigma", "1", "--kind", "pink"}, 2},
      {{"health", "--server", url()}, 0},
      {{"--help"}, 0},
  };
  const std::size_t before = files();
  for (const auto& [arguments, exit_code] : cases) {
    const Finished finished = crease(arguments);
    EXPECT_EQ(finished.exit_code, exit_code) << testing::PrintToString(arguments) << finished.errors;
    EXPECT_EQ(finished.errors.empty(), exit_code == 0) << testing::PrintToString(arguments);
  }
  EXPECT_EQ(files(), before);
}

TEST_F(CommandLine, TheServerMayComeFromTheEnvironment) {
  const auto run = [](const std::string& server, const std::string& command) {
    return run_program({"/usr/bin/env", "CREASED_URL=" + server, "/bin/sh", "-c", CREASE_BIN + (" " + command)});
  };
  EXPECT_EQ(run(url(), "health").exit_code, 0);
  EXPECT_EQ(run("http://127.0.0.1:1", "health").exit_code, 4);
  EXPECT_EQ(run("http://127.0.0.1:1", "health --server " + url()).exit_code, 0);
  const std::string local = "smooth " + path("noisy.obj") + " -o " + path("out.obj") + " --local -p sweeps=1";
  EXPECT_EQ(run("http://127.0.0.1:1", local).exit_code, 0);
}

TEST_F(CommandLine, FailuresAreProblemDocumentsWithJson) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {{"smooth", "--json"}, "usage"},
      {{"smooth", path("missing.obj"), "-o", path("out.obj"), "--local", "--json"}, "file_unreadable"},
      {{"status", "0123456789abcdef0123", "--json", "--server", url()}, "job_not_found"},
      {{"health", "--json", "--server", "127.0.0.1:1"}, "server_unreachable"},
  };
  for (const auto& [arguments, code] : cases) {
    const Finished finished = crease(arguments);
    EXPECT_EQ(json::parse(finished.output)["code"], code) << testing::PrintToString(arguments);
    EXPECT_THAT(finished.errors, HasSubstr(code));
  }
}

TEST_F(CommandLine, AJobGoesThroughItsWholeLife) {
  const Finished submitted = remote({"submit", path("noisy.obj"), "-p", "sweeps=10", "--json"});
  ASSERT_EQ(submitted.exit_code, 0) << submitted.errors;
  const auto id = json::parse(submitted.output)["id"].get<std::string>();

  const Finished watched = remote({"watch", id, "--json"});
  EXPECT_EQ(watched.exit_code, 0) << watched.errors;
  EXPECT_EQ(json::parse(watched.output)["state"], "succeeded");
  EXPECT_EQ(remote({"watch", id}).exit_code, 0);
  EXPECT_THAT(remote({"status", id}).output, HasSubstr("succeeded"));
  const json listed = json::parse(remote({"list", "--json", "--limit", "1000"}).output);
  EXPECT_TRUE(std::ranges::any_of(listed["jobs"], [&](const json& job) { return job["id"] == id; }));
  EXPECT_THAT(remote({"list", "--state", "succeeded"}).output, HasSubstr(id));

  EXPECT_EQ(remote({"mesh", id, "-o", path("out.ply")}).exit_code, 0);
  EXPECT_THAT(bytes("out.ply"), testing::StartsWith("ply"));
  EXPECT_EQ(json::parse(remote({"labels", id}).output)["edges"].size(), 288U);
  EXPECT_EQ(remote({"labels", id, "-o", path("labels.csv"), "--min", "0.5"}).exit_code, 0);
  EXPECT_TRUE(json::parse(remote({"ridges", id}).output)["ridges"].is_array());
  EXPECT_EQ(remote({"ridges", id, "-o", path("ridges.glb")}).exit_code, 0);
  EXPECT_THAT(bytes("ridges.glb"), testing::StartsWith("glTF"));
  EXPECT_EQ(remote({"ridges", id, "--format", "glb"}).exit_code, 2);
  EXPECT_EQ(remote({"ridges", id, "-o", path("ridges.csv")}).exit_code, 2);
  EXPECT_EQ(json::parse(remote({"report", id}).output)["sweeps"].size(), 10U);
  EXPECT_EQ(remote({"labels", id, "--min", "2"}).exit_code, 2);

  EXPECT_EQ(json::parse(remote({"delete", id, "--json"}).output), (json{{"deleted", id}}));
  EXPECT_EQ(remote({"status", id}).exit_code, 7);
}

TEST_F(CommandLine, ACancelledJobHasNoMesh) {
  const auto id = server().submit(obj_text(icosphere(4)), kLong)["id"].get<std::string>();
  server().wait_for_state(id, "running");
  EXPECT_EQ(remote({"mesh", id, "-o", path("out.obj")}).exit_code, 8);
  EXPECT_EQ(remote({"cancel", id}).exit_code, 0);
  EXPECT_EQ(remote({"watch", id}).exit_code, 6);
  EXPECT_EQ(remote({"mesh", id, "-o", path("out.obj")}).exit_code, 6);
  EXPECT_FALSE(exists("out.obj"));
}

TEST_F(CommandLine, AnInterruptionEndsALocalRun) {
  const Finished finished = interrupted({"smooth", big(), "-o", path("out.obj"), "--local", "--json", "-p", kLong});
  EXPECT_EQ(finished.exit_code, 6) << finished.errors;
  EXPECT_EQ(json::parse(finished.output)["code"], "interrupted");
  EXPECT_FALSE(exists("out.obj"));
}

TEST_F(CommandLine, AnInterruptionCancelsTheSubmittedJob) {
  const Finished finished =
      interrupted({"smooth", big(), "-o", path("out.obj"), "-p", kLong, "-p", "seed=77", "--server", url()});
  EXPECT_EQ(finished.exit_code, 6) << finished.errors;
  const json newest = json::parse(remote({"list", "--json", "--limit", "1"}).output)["jobs"][0];
  EXPECT_EQ(newest["parameters"]["seed"], 77);
  EXPECT_EQ(server().wait_for_end(newest["id"].get<std::string>())["state"], "cancelled");
}

TEST_F(CommandLine, AnInterruptedWatchLeavesTheJobRunning) {
  const auto id = server().submit(obj_text(icosphere(4)), kLong + "&seed=78")["id"].get<std::string>();
  server().wait_for_state(id, "running");
  EXPECT_EQ(interrupted({"watch", id, "--server", url()}).exit_code, 6);
  EXPECT_EQ(json::parse(remote({"status", id, "--json"}).output)["state"], "running");
  EXPECT_EQ(remote({"delete", id}).exit_code, 0);
}

TEST_F(CommandLine, NoiseIsRepeatableAndMeasured) {
  EXPECT_EQ(crease({"noise", path("input.obj"), "-o", path("again.obj"), "--sigma", "0.1"}).exit_code, 0);
  EXPECT_EQ(bytes("again.obj"), bytes("noisy.obj"));

  const json itself = json::parse(crease({"measure", path("input.obj"), path("input.obj"), "--json"}).output);
  EXPECT_EQ(itself["mean_normal_error_deg"], 0.0);
  EXPECT_FALSE(itself.contains("labels"));

  ASSERT_EQ(crease({"smooth", path("input.obj"), "-o", path("out.obj"), "--labels", path("labels.json"), "--local",
                    "-p", "sweeps=2"})
                .exit_code,
            0);
  const Finished measured =
      crease({"measure", path("input.obj"), path("noisy.obj"), "--labels", path("labels.json"), "--json"});
  ASSERT_EQ(measured.exit_code, 0) << measured.errors;
  const json noisy = json::parse(measured.output);
  EXPECT_GT(noisy["mean_normal_error_deg"], 0.0);
  EXPECT_NEAR(noisy["mean_vertex_error"].get<double>(), 0.16, 0.03);  // mean of |N(0, 0.1²)³|
  EXPECT_EQ(noisy["labels"]["reference_ridges"], 48);
}

TEST_F(CommandLine, WarnsOfAParameterThatIsNotUsed) {
  for (const std::vector<std::string>& where : {std::vector<std::string>{"--local"}, {"--server", url()}}) {
    std::vector<std::string> arguments = {"smooth",   path("noisy.obj"),   "-o",    path("out.obj"),
                                          "--report", path("report.json"), "-p",    "method=taubin",
                                          "-p",       "sweeps=4",          "--json"};
    arguments.insert(arguments.end(), where.begin(), where.end());
    const Finished finished = crease(arguments);
    ASSERT_EQ(finished.exit_code, 0) << finished.errors;
    EXPECT_THAT(finished.errors, HasSubstr("parameter 'sweeps' is '4' and is not used"));
    const json job = json::parse(finished.output)["job"];
    EXPECT_EQ(job["warnings"][0]["code"], "parameter_not_used");
    EXPECT_EQ(job["parameters"]["flow_step"], 0.6307);
    EXPECT_FALSE(job["parameters"].contains("sweeps"));
    EXPECT_EQ(json::parse(bytes("report.json"))["warnings"], job["warnings"]);
  }
}

TEST_F(CommandLine, HelpListsParametersByGroupWithDefaultsAndWhereTheyMatter) {
  const std::string smooth = crease({"smooth", "--help"}).output;
  for (const Parameter& parameter : parameter_table()) EXPECT_THAT(smooth, HasSubstr(parameter.meaning));
  EXPECT_THAT(smooth, HasSubstr("\nFace process:\n  rounds=10    a whole number from 1 to 100, in rounds; with "
                                "method=mrf, process=face or both\n"));
  EXPECT_THAT(smooth, HasSubstr("\n      taubin: 0.6307, a number from 0.0001 to 0.65\n"));
  EXPECT_THAT(crease({"--help"}).output, HasSubstr("Exit codes"));
}

TEST_F(CommandLine, ListsTheParametersAsTheServiceDoes) {
  json local = json::parse(crease({"parameters", "--json"}).output);
  json& retention = local["properties"]["retention_hours"];
  EXPECT_EQ(retention["maximum"], 8760.0);
  retention["maximum"] = 720.0;  // of the service, where --max-retention-hours says no other
  EXPECT_EQ(local, json::parse(call("GET", "/v1/parameters").body));
}

}  // namespace
}  // namespace crease::test
