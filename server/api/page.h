#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "server/api/call.h"

namespace creased {

/// The workbench: the files of the web page, held in memory. Each may have a copy that is already compressed with gzip.
class Page {
 public:
  /// Reads the files of `folder`. Without a folder the page says that it was not built.
  explicit Page(const std::filesystem::path& folder);

  /// Where the page is installed: beside the binary, or below share/creased.
  static std::filesystem::path installed_folder(const std::filesystem::path& executable);

  void get_page(Call& call) const { send(call, "index.html"); }
  void get_docs(Call& call) const { send(call, "docs.html"); }
  /// \throw crease::Error not_found
  void get_asset(Call& call) const { send(call, "assets/" + call.id); }

 private:
  struct File {
    std::string bytes, compressed, media_type, etag;
  };

  void send(Call& call, const std::string& name) const;

  std::map<std::string, File> files_;  // by path below the folder
};

}  // namespace creased
