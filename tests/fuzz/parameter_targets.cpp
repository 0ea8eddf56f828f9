#include <google/protobuf/util/message_differencer.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "core/io/vertex_weights.h"
#include "crease/v1/job.pb.h"
#include "proto/convert.h"
#include "proto/parameter_table.h"
#include "server/api/submit_message.h"
#include "server/api/upload.h"
#include "tests/fuzz/lines.h"
#include "tests/fuzz/properties.h"
#include "tests/fuzz/target.h"
#include "tests/fuzz/targets.h"
#include "tests/support/server_process.h"

namespace crease::fuzz {
namespace {

using google::protobuf::util::MessageDifferencer;

/// Checks that accepted parameters are the same in every form and give options, unless they contradict each other.
void require_usable(const v1::Parameters& parameters) {
  validate(parameters);
  require(MessageDifferencer::Equals(parameters_from_json(to_json(parameters)), parameters),
          "JSON keeps the parameters");
  v1::Parameters resolved;
  if (refused([&] { resolved = resolve(parameters); })) return;
  validate(resolved);
  require(MessageDifferencer::Equals(resolve(resolved), resolved), "resolved parameters resolve to themselves");
  to_options(resolved);
}

std::string read_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// A message in a file, and the files that it is split into.
struct SplitMessage {
  explicit SplitMessage(std::string_view bytes) {
    std::ofstream(folder().path() / "message", std::ios::binary) << bytes;
    fields = creased::split_submit_message(folder().path() / "message", mesh, weights);
    mesh.finish();
    weights.finish();
  }

  static const test::TemporaryFolder& folder() {
    static const test::TemporaryFolder folder;
    return folder;
  }

  creased::UploadFile mesh{folder().path() / "mesh"};
  creased::UploadFile weights{folder().path() / "weights"};
  creased::SubmitFields fields;
};

void require_as_protobuf_reads(const SplitMessage& split, std::string_view bytes) {
  v1::SubmitJobRequest message;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    return;  // strings in protobuf must be UTF-8; file names are cleaned later
  }
  require(message.name() == split.fields.name && message.format() == split.fields.format, "the texts are the same");
  require(MessageDifferencer::Equals(message.parameters(), split.fields.parameters), "the parameters are the same");
  require(message.mesh() == read_file(split.mesh.path()), "the mesh is the same");
  const std::vector<double> weights(message.weights().begin(), message.weights().end());
  const std::string json = weights.empty() ? "[]" : read_file(split.weights.path());
  require(read_weights(json, weights.size()) == weights, "the weights are the same");
}

}  // namespace

void fuzz_parameters(std::string_view bytes) {
  v1::Parameters parameters;
  const bool is_refused = refused([&] {
    while (!bytes.empty()) {
      const auto [name, value] = take_pair(bytes);
      set_parameter(parameters, name, value);
    }
  });
  if (!is_refused) require_usable(parameters);
}

void fuzz_parameters_json(std::string_view bytes) {
  const auto object = nlohmann::json::parse(bytes, nullptr, false);
  if (object.is_discarded()) return;
  v1::Parameters parameters;
  if (refused([&] { parameters = parameters_from_json(object); })) return;
  require_usable(parameters);
}

void fuzz_submit_message(std::string_view bytes) {
  refused([&] {
    const SplitMessage split(bytes);
    require_as_protobuf_reads(split, bytes);
    require_usable(split.fields.parameters);
  });
}

}  // namespace crease::fuzz
