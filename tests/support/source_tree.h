#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace crease::test {

/// Paths in this module are relative to the root of the source tree, with '/' as separator.
using Paths = std::set<std::string>;

/// The root of the source tree.
std::filesystem::path source_root();

/// The text of a file of the source tree.
std::string source_text(const std::string& path);

/// The folders that hold the project's files: the top-level ones, and the rooms within them.
Paths rooms();

/// The .h, .cpp, .proto and CMakeLists.txt files in the given top-level folders.
Paths source_files(const std::vector<std::string>& folders);

/// The files of `source_files(folders)` whose code matches a regular expression. Comments do not count.
Paths files_with(const std::string& pattern, const std::vector<std::string>& folders);

/// What a Markdown text has in `backticks` or as the target of a link, if it looks like a path of the source tree.
Paths paths_in(const std::string& markdown);

}  // namespace crease::test
