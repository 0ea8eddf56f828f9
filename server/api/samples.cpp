#include "server/api/samples.h"

#include "core/io/encode.h"
#include "core/measure/samples.h"

namespace creased {
namespace code = crease::code;
namespace {

const std::string& part_file() {
  static const std::string bytes = crease::encode_mesh({crease::sample_part(), {}, {}, {}}, crease::MeshFormat::kPly);
  return bytes;
}

const std::string& scan_file() {
  static const std::string bytes = crease::encode_mesh({crease::sample_scan(), {}, {}, {}}, crease::MeshFormat::kPly);
  return bytes;
}

void get_sample(Services&, Call& call) {
  const bool part = call.id == "part.ply";
  if (!part && call.id != "scan.ply") {
    throw crease::Error(code::kNotFound, "no sample '" + call.id + "'; there are part.ply and scan.ply");
  }
  call.response.set_header("Content-Disposition", "attachment; filename=\"" + call.id + "\"");
  call.response.set_header("Cache-Control", "public, max-age=3600");
  call.response.set_content(part ? part_file() : scan_file(), "model/ply");
}

}  // namespace

std::vector<Route> sample_routes() {
  return {{"GET",
           "/v1/samples/{name}",
           "get_sample",
           "Download a mesh to try the service with: part.ply, a machined part, or scan.ply, a scan",
           {},
           {{200, "The mesh.", {"model/ply"}, ""}},
           {code::kNotFound},
           get_sample}};
}

}  // namespace creased
