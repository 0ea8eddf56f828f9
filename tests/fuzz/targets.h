#pragma once

#include <string_view>

// The functions behind the targets. The table in target.cpp names the targets; a test compares it with the folders.
namespace crease::fuzz {

// Mesh files, from decoding to the files of a result: mesh_targets.cpp.
void fuzz_obj(std::string_view bytes);
void fuzz_ply(std::string_view bytes);
void fuzz_off(std::string_view bytes);
void fuzz_stl(std::string_view bytes);
void fuzz_gltf(std::string_view bytes);
void fuzz_glb(std::string_view bytes);
/// Input: the number of vertices in the first byte, then JSON.
void fuzz_weights(std::string_view bytes);

// Parameters and jobs: parameter_targets.cpp and job_target.cpp.
/// Input: lines "name=value".
void fuzz_parameters(std::string_view bytes);
void fuzz_parameters_json(std::string_view bytes);
/// Input: a serialised crease.v1.SubmitJobRequest.
void fuzz_submit_message(std::string_view bytes);
/// Runs a whole job with few sweeps. Input: lines "name=value", an empty line, an OFF file.
void fuzz_job(std::string_view bytes);

// HTTP: http_targets.cpp.
void fuzz_http_head(std::string_view bytes);
/// Input: a Content-Type in the first line, then the body.
void fuzz_multipart(std::string_view bytes);
/// Input: everything that a client sends on one connection.
void fuzz_http(std::string_view bytes);

}  // namespace crease::fuzz
