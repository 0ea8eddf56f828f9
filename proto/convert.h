#pragma once

#include <google/protobuf/message.h>

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "core/job.h"
#include "crease/v1/job.pb.h"
#include "crease/v1/result.pb.h"

namespace crease {

v1::InputFacts to_message(const InputFacts& facts);
/// The facts with the format and the hash of the weights; name, bytes and sha256 are the receiver's.
v1::InputFacts to_message(const CheckedInput& input);
v1::Energy to_message(const Energy& energy);
v1::Progress to_message(const SweepView& view);
v1::Sweep to_message(const SweepRecord& record);
v1::ResultFacts to_message(const ResultFacts& facts);
v1::Warning to_message(const Warning& warning);
v1::LabelledMesh to_message(const LabelledMesh& mesh);

InputFacts from_message(const v1::InputFacts& message);
ResultFacts from_message(const v1::ResultFacts& message);
/// \throw Error internal when the arrays do not fit together
LabelledMesh from_message(const v1::LabelledMesh& message);

/// JSON with the names of the schema, on one line. Fields without presence are always there, unset optional ones and
/// messages are not. Strings must be UTF-8.
std::string json_text(const google::protobuf::Message& message);
nlohmann::ordered_json to_json(const google::protobuf::Message& message);

/// What identifies the result of an upload: a hash over its bytes, its format, its weights, every parameter that
/// changes the result and the version of the algorithm. 20 hexadecimal digits. The same for a job over HTTP and a run
/// in process.
std::string job_fingerprint(const v1::InputFacts& input, const v1::Parameters& resolved);

/// The extras of a mesh file: job (fingerprint), parameters that change the result, counts. No time that a run took, so
/// that the same result gives the same bytes.
nlohmann::ordered_json mesh_extras(const std::string& fingerprint, const v1::Parameters& resolved,
                                   const InputFacts& input, const ResultFacts& result);

/// SHA-256 as 64 hexadecimal digits.
std::string sha256_hex(std::string_view bytes);

}  // namespace crease
