#include "server/api/page.h"

#include <fmt/format.h>

#include <fstream>
#include <iterator>

#include "core/base/text.h"

namespace creased {
namespace {

namespace fs = std::filesystem;

// What the page may load: its own files and this service, nothing else. Pictures and workers are made by the page.
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self' blob:; "
    "worker-src 'self'; font-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
constexpr const char* kNotBuilt =
    "<!doctype html><html lang=\"en\"><title>creased</title><p>This build of creased has no page, because npm was not "
    "there when it was made. The API is complete: see <a href=\"openapi.json\">openapi.json</a>.</p></html>\n";

const std::map<std::string, std::string> kMediaTypes = {{".css", "text/css; charset=utf-8"},
                                                        {".html", "text/html; charset=utf-8"},
                                                        {".js", "text/javascript; charset=utf-8"},
                                                        {".png", "image/png"},
                                                        {".svg", "image/svg+xml"},
                                                        {".woff2", "font/woff2"}};

std::string whole(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

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

}  // namespace

Page::Page(const fs::path& folder) {
  files_["index.html"] = {kNotBuilt, {}, kMediaTypes.at(".html"), "not-built"};
  files_["docs.html"] = files_["index.html"];
  if (folder.empty()) return;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const auto type = kMediaTypes.find(entry.path().extension().string());
    if (!entry.is_regular_file() || type == kMediaTypes.end()) continue;
    File file{whole(entry.path()), whole(entry.path().string() + ".gz"), type->second, {}};
    file.etag = fmt::format("{:016x}", std::hash<std::string>()(file.bytes));
    files_[entry.path().lexically_relative(folder).generic_string()] = std::move(file);
  }
}

fs::path Page::installed_folder(const fs::path& executable) {
  const fs::path bin = executable.parent_path();
  for (const fs::path& folder : {bin / "page", bin.parent_path() / "share" / "creased" / "page"}) {
    if (fs::exists(folder / "index.html")) return folder;
  }
  return {};
}

void Page::send(Call& call, const std::string& name) const {
  const auto found = files_.find(name);
  if (found == files_.end()) throw crease::Error("not_found", "no resource at " + call.request.path);
  const File& file = found->second;
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

}  // namespace creased
