#include <malloc.h>
#include <unistd.h>

#include <new>

#include "core/job.h"
#include "crease/v1/inspection.pb.h"
#include "proto/convert.h"
#include "proto/error_table.h"
#include "server/store/durable_file.h"
#include "server/store/failure.h"
#include "server/worker/frame.h"
#include "server/worker/inspector.h"
#include "server/worker/mapped_file.h"

namespace creased {
namespace v1 = crease::v1;
namespace {

std::optional<crease::MeshFormat> requested_format(const v1::InspectRequest& request) {
  if (request.format().empty()) return crease::format_from_filename(request.name());
  const auto format = crease::format_from_name(request.format());
  if (!format) throw crease::Error(crease::code::kMeshFormatUnknown, "there is no format '" + request.format() + "'");
  return format;
}

v1::InspectResponse check(const v1::InspectRequest& request, const crease::DecodeLimits& limits) {
  const MappedFile upload(request.path());
  std::optional<MappedFile> weights;
  if (!request.weights().empty()) weights.emplace(request.weights());
  const auto input = crease::check_input(upload.bytes(), requested_format(request), limits, bytes_of(weights));
  v1::InspectResponse response;
  *response.mutable_facts() = crease::to_message(input);
  for (const auto& warning : input.warnings) *response.add_warnings() = crease::to_message(warning);
  return response;
}

v1::InspectResponse refusal(const crease::Error& error) {
  v1::InspectResponse response;
  *response.mutable_error() = crease::to_problem(error);
  return response;
}

v1::InspectResponse answer(const v1::InspectRequest& request, const crease::DecodeLimits& limits) {
  try {
    return check(request, limits);
  } catch (const crease::Error& error) {
    return refusal(error);
  } catch (const std::bad_alloc&) {
    return refusal({code::kInspectionFailed, "checking the mesh needs more memory than is allowed"});
  } catch (const std::exception& error) {
    return refusal({code::kInspectionFailed, std::string("checking the mesh failed: ") + error.what()});
  }
}

}  // namespace

int run_inspector_child(std::size_t max_vertices, std::size_t max_faces) {
  // Whatever else prints to standard output must not reach the answers.
  const Descriptor answers(::dup(STDOUT_FILENO));
  ::dup2(STDERR_FILENO, STDOUT_FILENO);
  v1::InspectRequest request;
  while (read_frame(STDIN_FILENO, request) == FrameOutcome::kRead) {
    if (!write_frame(answers.get(), answer(request, {max_vertices, max_faces}))) break;
    ::malloc_trim(0);
  }
  return 0;
}

}  // namespace creased
