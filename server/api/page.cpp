#include "server/api/page.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/base/text.h"

namespace creased {
namespace code = crease::code;
namespace {

// What the page may load: its own files and this service, nothing else. Pictures and workers are made by the page.
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self' blob:; "
    "worker-src 'self'; font-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

bool accepts_gzip(std::string_view header) {
  while (!header.empty()) {
    const auto comma = std::min(header.find(','), header.size());
    const std::string_view coding = crease::trimmed(header.substr(0, comma));
    header.remove_prefix(std::min(comma + 1, header.size()));
    const bool refused = coding.ends_with("q=0") || coding.ends_with("q=0.0");
    if (coding.starts_with("gzip") && !refused) return true;
  }
  return false;
}

void send(const Services& services, Call& call, const std::string& name) {
  const PageFiles::File* const found = services.page.find(name);
  if (found == nullptr) throw crease::Error(code::kNotFound, "no resource at " + call.request.path);
  const PageFiles::File& file = *found;
  auto& response = call.response;
  const bool compressed = !file.compressed.empty() && accepts_gzip(call.exchange.head.header("Accept-Encoding"));
  const std::string etag = fmt::format("\"{}{}\"", file.etag, compressed ? "-gz" : "");
  response.set_header("ETag", etag);
  response.set_header("Vary", "Accept-Encoding");
  response.set_header("Content-Security-Policy", kPolicy);
  // The names of assets have a hash of their content.
  const bool lasting = name.starts_with("assets/");
  response.set_header("Cache-Control", lasting ? "public, max-age=31536000, immutable" : "no-cache");
  if (call.exchange.head.header("If-None-Match") == etag) {
    response.status = 304;
    return;
  }
  if (compressed) response.set_header("Content-Encoding", "gzip");
  response.set_content(compressed ? file.compressed : file.bytes, file.media_type);
}

void get_page(Services& services, Call& call) { send(services, call, "index.html"); }
void get_docs(Services& services, Call& call) { send(services, call, "docs.html"); }
void get_asset(Services& services, Call& call) { send(services, call, "assets/" + call.id); }

}  // namespace

std::vector<Route> page_routes() {
  return {
      {"GET",
       "/",
       "get_page",
       "The workbench, a page",
       {},
       {{200, "The page.", {"text/html"}, ""}},
       {},
       get_page,
       Access::kOpen},
      {"GET",
       "/docs",
       "get_docs",
       "This OpenAPI document as a page",
       {},
       {{200, "The page.", {"text/html"}, ""}},
       {},
       get_docs,
       Access::kOpen},
      {"GET",
       "/assets/{name}",
       "get_asset",
       "A file of the page",
       {},
       {{200, "The file.", {"text/javascript", "text/css", "image/svg+xml"}, ""}},
       {code::kNotFound},
       get_asset,
       Access::kOpen},
  };
}

}  // namespace creased
