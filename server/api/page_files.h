#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace creased {

/// The workbench: the files of the web page, held in memory. Each may have a copy that is already compressed with gzip.
class PageFiles {
 public:
  /// Reads the files of `folder`. Without a folder the page says that it was not built.
  explicit PageFiles(const std::filesystem::path& folder);

  /// Where the page is installed: beside the binary, or below share/creased.
  static std::filesystem::path installed_folder(const std::filesystem::path& executable);

  struct File {
    std::string bytes, compressed, media_type, etag;
  };
  /// The file at this path below the folder; null when there is none.
  const File* find(const std::string& name) const;

 private:
  std::map<std::string, File> files_;  // by path below the folder
};

}  // namespace creased
