#include "server/api/page_files.h"

#include <fmt/format.h>

#include <fstream>
#include <iterator>

namespace creased {
namespace {

namespace fs = std::filesystem;

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

}  // namespace

PageFiles::PageFiles(const fs::path& folder) {
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

fs::path PageFiles::installed_folder(const fs::path& executable) {
  const fs::path bin = executable.parent_path();
  for (const fs::path& folder : {bin / "page", bin.parent_path() / "share" / "creased" / "page"}) {
    if (fs::exists(folder / "index.html")) return folder;
  }
  return {};
}

const PageFiles::File* PageFiles::find(const std::string& name) const {
  const auto found = files_.find(name);
  return found == files_.end() ? nullptr : &found->second;
}

}  // namespace creased
