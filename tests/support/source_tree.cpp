#include "tests/support/source_tree.h"

#include <algorithm>
#include <array>
#include <regex>

#include "tests/support/meshes.h"

namespace crease::test {
namespace {

namespace fs = std::filesystem;

constexpr std::array kFolders = {"client", "core", "docker", "proto", "server", "tests"};
constexpr std::array kFoldersWithRooms = {"client", "core", "server", "tests"};

std::string tree_path(const fs::path& path) { return path.lexically_relative(source_root()).generic_string(); }

bool holds_files(const fs::path& folder) {
  return std::any_of(fs::directory_iterator(folder), fs::directory_iterator(),
                     [](const fs::directory_entry& entry) { return entry.is_regular_file(); });
}

bool is_source(const fs::path& file) {
  const std::string extension = file.extension().string();
  return extension == ".h" || extension == ".cpp" || extension == ".proto" || file.filename() == "CMakeLists.txt";
}

std::string without_comments(const std::string& text) {
  static const std::regex comment(R"((^|\s)(//|# ).*)");
  return std::regex_replace(text, comment, "");
}

void add_matches(const std::string& text, const std::regex& pattern, Paths& found) {
  for (std::sregex_iterator match(text.begin(), text.end(), pattern), end; match != end; ++match) {
    found.insert((*match)[1]);
  }
}

}  // namespace

fs::path source_root() { return CREASED_SOURCE_DIR; }

std::string source_text(const std::string& path) { return read_file(source_root() / path); }

Paths rooms() {
  Paths found(kFolders.begin(), kFolders.end());
  for (const char* const folder : kFoldersWithRooms) {
    for (const auto& entry : fs::directory_iterator(source_root() / folder)) {
      if (entry.is_directory() && entry.path().filename() != "node_modules" && holds_files(entry.path()))
        found.insert(tree_path(entry.path()));
    }
  }
  return found;
}

Paths source_files(const std::vector<std::string>& folders) {
  Paths files;
  for (const std::string& folder : folders) {
    for (auto entry = fs::recursive_directory_iterator(source_root() / folder);
         entry != fs::recursive_directory_iterator(); ++entry) {
      if (entry->path().filename() == "node_modules") entry.disable_recursion_pending();
      if (entry->is_regular_file() && is_source(entry->path())) files.insert(tree_path(entry->path()));
    }
  }
  return files;
}

Paths files_with(const std::string& pattern, const std::vector<std::string>& folders) {
  const std::regex regex(pattern);
  Paths files = source_files(folders);
  std::erase_if(
      files, [&](const std::string& file) { return !std::regex_search(without_comments(source_text(file)), regex); });
  return files;
}

Paths paths_in(const std::string& markdown) {
  Paths found;
  add_matches(markdown, std::regex(R"(`((?:client|core|docker|proto|server|tests)/[^`\s]*)`)"), found);
  add_matches(markdown, std::regex(R"(`([A-Za-z.]+\.(?:md|txt|json|yaml))`)"), found);
  return found;
}

}  // namespace crease::test
