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
/// The facts, the format and the hash of the weights. The caller adds name, bytes and sha256.
v1::InputFacts to_message(const CheckedInput& input);
v1::Energy to_message(const Energy& energy);
v1::Progress to_message(const SweepView& view);
v1::Sweep to_message(const SweepRecord& record);
v1::ResultFacts to_message(const ResultFacts& facts);
v1::Warning to_message(const Warning& warning);
v1::LabelledMesh to_message(const LabelledMesh& mesh);

/// Adds a warning unless it is there already.
void add_once(const v1::Warning& warning, google::protobuf::RepeatedPtrField<v1::Warning>& warnings);

InputFacts from_message(const v1::InputFacts& message);
ResultFacts from_message(const v1::ResultFacts& message);
/// \throw Error internal when the sizes of the arrays or their indices do not match
LabelledMesh from_message(const v1::LabelledMesh& message);

/// The message as JSON on one line, with the field names of the schema. It includes fields without presence even when
/// they are zero, and leaves out unset optional fields and messages. Strings must be UTF-8.
std::string json_text(const google::protobuf::Message& message);
nlohmann::ordered_json to_json(const google::protobuf::Message& message);

/// Identifies a result: 20 hexadecimal digits of a hash of the upload's bytes, its format, its weights, every parameter
/// that changes the result, and the version of the program. A job over HTTP and a local run have the same fingerprint.
std::string job_fingerprint(const v1::InputFacts& input, const v1::Parameters& resolved);

/// The extras of a mesh file: the job's fingerprint, the parameters that change the result, and counts. They include no
/// run time, so that equal results give equal bytes.
nlohmann::ordered_json mesh_extras(const std::string& fingerprint, const v1::Parameters& resolved,
                                   const InputFacts& input, const ResultFacts& result);

/// SHA-256 as 64 hexadecimal digits.
std::string sha256_hex(std::string_view bytes);

}  // namespace crease
