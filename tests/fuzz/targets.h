#pragma once

#include <string_view>

/// The targets one by one; target.cpp has them by name.
namespace crease::fuzz {

// Mesh files from decoding to the files of a result: mesh_targets.cpp.
void fuzz_obj(std::string_view bytes);
void fuzz_ply(std::string_view bytes);
void fuzz_off(std::string_view bytes);
void fuzz_stl(std::string_view bytes);
void fuzz_gltf(std::string_view bytes);
void fuzz_glb(std::string_view bytes);
/// A number of vertices in the first byte, then the JSON.
void fuzz_weights(std::string_view bytes);

// What is to be done with a mesh: parameter_targets.cpp and job_target.cpp.
/// Lines "name=value".
void fuzz_parameters(std::string_view bytes);
void fuzz_parameters_json(std::string_view bytes);
/// A serialised crease.v1.SubmitJobRequest.
void fuzz_submit_message(std::string_view bytes);
/// Lines "name=value", an empty line, an OFF file: a whole job of few sweeps.
void fuzz_job(std::string_view bytes);

// HTTP: http_targets.cpp.
void fuzz_http_head(std::string_view bytes);
/// A Content-Type in the first line, then the body.
void fuzz_multipart(std::string_view bytes);
/// All that a client sends on one connection.
void fuzz_http(std::string_view bytes);

}  // namespace crease::fuzz
