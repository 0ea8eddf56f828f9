#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

const fs::path kRoot = CREASED_SOURCE_DIR;
const std::vector<std::string> kRooms = {"core", "proto", "server", "client"};
constexpr std::size_t kMaxLines = 450;

using Graph = std::map<std::string, std::set<std::string>>;

std::vector<std::string> lines_of(const fs::path& file) {
  std::ifstream in(file);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

bool has_extension(const fs::path& file, const std::set<std::string>& extensions) {
  return extensions.contains(file.extension().string());
}

std::vector<fs::path> files_below(const std::string& room, const std::set<std::string>& extensions) {
  std::vector<fs::path> files;
  for (auto entry = fs::recursive_directory_iterator(kRoot / room); entry != fs::recursive_directory_iterator();
       ++entry) {
    if (entry->path().filename() == "node_modules") {
      entry.disable_recursion_pending();
    } else if (entry->is_regular_file() && has_extension(entry->path(), extensions)) {
      files.push_back(fs::relative(entry->path(), kRoot));
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// What a source names in its #include and import lines, as written.
std::vector<std::string> includes_of(const fs::path& file) {
  static const std::regex directive(R"(^\s*(?:#\s*include|import)\s*["<]([^">]+)[">])");
  std::vector<std::string> names;
  std::smatch match;
  for (const std::string& line : lines_of(kRoot / file)) {
    if (std::regex_search(line, match, directive)) names.push_back(match[1]);
  }
  return names;
}

/// Our sources with the ones of ours that they include; generated messages count as proto.
Graph include_graph() {
  Graph graph;
  for (const std::string& room : kRooms) {
    for (const fs::path& file : files_below(room, {".h", ".cpp", ".proto"})) {
      std::set<std::string>& targets = graph[file.string()];
      for (const std::string& name : includes_of(file)) {
        const bool message = name.starts_with("crease/v1/");
        const fs::path beside = file.parent_path() / name;
        if (message) {
          targets.insert("proto/" + std::regex_replace(name, std::regex(R"(\.pb\.h$)"), ".proto"));
        } else if (fs::exists(kRoot / name)) {
          targets.insert(name);
        } else if (fs::exists(kRoot / beside)) {
          targets.insert(beside.lexically_normal().string());
        }
      }
    }
  }
  return graph;
}

std::string room_of(const std::string& file) { return file.substr(0, file.find('/')); }

/// "core/io" of core/io/decode.h; empty for files at the top of a room, which may stand above or below its walls.
std::string wall_of(const std::string& file) {
  const std::string folder = fs::path(file).parent_path().string();
  return folder == room_of(file) ? std::string() : folder;
}

/// "io" of core/io/decode.h in "core"; empty for files that are in no folder of it.
std::string floor_of(const std::string& file, const std::string& room) {
  const fs::path path(file);
  auto part = path.begin();
  if (*part != room || std::distance(path.begin(), path.end()) < 3) return {};
  return (++part)->string();
}

/// For each folder of a room, the other folders of it that it includes.
Graph included_floors(const std::string& room) {
  Graph included;
  for (const auto& [file, targets] : include_graph()) {
    const std::string from = floor_of(file, room);
    if (from.empty()) continue;
    included[from];
    for (const std::string& target : targets) {
      if (const std::string to = floor_of(target, room); !to.empty() && to != from) included[from].insert(to);
    }
  }
  return included;
}

/// The folders of a room with what they link, as `text` of CMake says with `function`.
Graph linked_floors(const std::string& text, const std::string& function) {
  const std::regex call("\n" + function + R"(\((\w+)(?: DEPENDS((?: \w+)*?))?(?:\s+LIBRARIES[^)]*)?\))");
  Graph linked;
  for (std::sregex_iterator match(text.begin(), text.end(), call), end; match != end; ++match) {
    std::istringstream names((*match)[2]);
    auto& of_floor = linked[(*match)[1]];
    for (std::string name; names >> name;) of_floor.insert(name);
  }
  return linked;
}

std::string text_of(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Where each type of ours is defined, by room and name.
std::map<std::string, std::string> defined_types(const Graph& graph) {
  static const std::regex definition(R"(^(?:class|struct|enum class) (\w+)[^;]*\{)");
  std::map<std::string, std::string> types;
  std::smatch match;
  for (const auto& [file, targets] : graph) {
    for (const std::string& line : lines_of(kRoot / file)) {
      if (std::regex_search(line, match, definition)) types[room_of(file) + "/" + match[1].str()] = file;
    }
  }
  return types;
}

std::vector<std::string> back_edges(const std::string& room, const std::set<std::string>& forbidden) {
  std::vector<std::string> found;
  for (const auto& [file, targets] : include_graph()) {
    if (room_of(file) != room) continue;
    for (const std::string& target : targets) {
      if (forbidden.contains(room_of(target))) found.push_back(fmt::format("{} -> {}", file, target));
    }
  }
  return found;
}

/// One circle of the graph as a path that ends where it began; empty when there is none.
std::vector<std::string> find_circle(const Graph& graph) {
  std::set<std::string> done;
  std::vector<std::string> path;
  std::function<bool(const std::string&)> closes = [&](const std::string& node) {
    if (done.contains(node)) return false;
    const auto seen = std::find(path.begin(), path.end(), node);
    if (seen != path.end()) {
      path.erase(path.begin(), seen);
      path.push_back(node);
      return true;
    }
    path.push_back(node);
    const auto targets = graph.find(node);
    if (targets != graph.end() && std::any_of(targets->second.begin(), targets->second.end(), closes)) return true;
    path.pop_back();
    done.insert(node);
    return false;
  };
  for (const auto& entry : graph) {
    if (closes(entry.first)) return path;
  }
  return {};
}

TEST(Rooms, EveryRoomHasSources) {
  const Graph graph = include_graph();
  for (const std::string& room : kRooms) {
    EXPECT_TRUE(std::any_of(graph.begin(), graph.end(), [&](const auto& entry) {
      return room_of(entry.first) == room;
    })) << room;
  }
  EXPECT_THAT(graph.at("proto/parameter_table.h"),
              testing::IsSupersetOf({"core/options/parameters.h", "proto/crease/v1/parameters.proto"}));
}

TEST(Rooms, CoreKnowsNeitherNetworkNorProtobuf) {
  EXPECT_THAT(back_edges("core", {"proto", "server", "client", "tests"}), testing::IsEmpty());
  const std::regex network("httplib|google/protobuf|sys/socket|sqlite|SQLiteCpp|spdlog");
  for (const fs::path& file : files_below("core", {".h", ".cpp"})) {
    for (const std::string& name : includes_of(file)) {
      EXPECT_FALSE(std::regex_search(name, network)) << file << " includes " << name;
    }
  }
}

TEST(Rooms, ProtoKnowsNeitherServerNorClient) {
  EXPECT_THAT(back_edges("proto", {"server", "client", "tests"}), testing::IsEmpty());
}

TEST(Rooms, ServerAndClientDoNotKnowEachOther) {
  EXPECT_THAT(back_edges("server", {"client", "tests"}), testing::IsEmpty());
  EXPECT_THAT(back_edges("client", {"server", "tests"}), testing::IsEmpty());
}

TEST(Rooms, ACircleOfIncludesWouldBeFound) {
  EXPECT_THAT(find_circle({{"a", {"b"}}, {"b", {"c", "d"}}, {"c", {}}, {"d", {"b"}}}),
              testing::ElementsAre("b", "d", "b"));
  EXPECT_THAT(find_circle({{"a", {"b", "c"}}, {"b", {"d"}}, {"c", {"d"}}, {"d", {}}}), testing::IsEmpty());
}

TEST(Rooms, FilesDoNotIncludeInCircles) { EXPECT_THAT(find_circle(include_graph()), testing::IsEmpty()); }

// A forward declaration leans on the file that defines the type, though it does not include it.
TEST(Rooms, FilesDoNotLeanOnEachOtherInCircles) {
  Graph graph = include_graph();
  const auto types = defined_types(graph);
  static const std::regex declaration(R"(^(?:class|struct|enum class) (\w+)(?: : \w+)?;)");
  std::smatch match;
  for (auto& [file, targets] : graph) {
    for (const std::string& line : lines_of(kRoot / file)) {
      if (!std::regex_search(line, match, declaration)) continue;
      const auto defined = types.find(room_of(file) + "/" + match[1].str());
      if (defined != types.end() && defined->second != file) targets.insert(defined->second);
    }
  }
  EXPECT_THAT(find_circle(graph), testing::IsEmpty());
}

// What a room includes is what it links, so that a back-edge does not link and no link is left over.
TEST(Rooms, RoomsOfCoreLinkWhatTheyInclude) {
  Graph linked;
  const Graph included = included_floors("core");
  for (const auto& [room, targets] : included) {
    linked.merge(linked_floors("\n" + text_of(kRoot / "core" / room / "CMakeLists.txt"), "add_core_room"));
  }
  EXPECT_EQ(included, linked);
}

TEST(Rooms, RoomsOfTheServerLinkWhatTheyInclude) {
  EXPECT_EQ(included_floors("server"), linked_floors(text_of(kRoot / "server" / "CMakeLists.txt"), "add_server_room"));
}

TEST(Rooms, TransportKnowsNoneOfItsCallers) {
  const Graph server = included_floors("server");
  EXPECT_THAT(server.at("transport"), testing::ElementsAre("access", "base"));
  for (const auto& [file, targets] : include_graph()) {
    if (floor_of(file, "server") != "transport") continue;
    for (const std::string& target : targets) EXPECT_FALSE(target.starts_with("proto/")) << file << " -> " << target;
  }
}

TEST(Rooms, FoldersDoNotIncludeInCircles) {
  Graph walls;
  for (const auto& [file, targets] : include_graph()) {
    for (const std::string& target : targets) {
      const std::string from = wall_of(file), to = wall_of(target);
      if (!from.empty() && !to.empty() && from != to) walls[from].insert(to);
    }
  }
  EXPECT_THAT(find_circle(walls), testing::IsEmpty());
}

/// Coefficients, which nobody reads.
const std::set<fs::path> kTables = {"core/choice/clean_table.h",
                                    "core/choice/expected_error_table.h",
                                    "core/choice/scan_error_table.h",
                                    "core/choice/second_look_table.h",
                                    "core/regression/first_normal_network.cpp",
                                    "core/regression/second_normal_network.cpp"};

TEST(Rooms, FilesAreShort) {
  for (const std::string room : {"core", "proto", "server", "client", "tests", "docker"}) {
    for (const fs::path& file : files_below(room, {".h", ".cpp", ".proto", ".sh", ".mjs", ".js", ".ts", ".txt"})) {
      if (kTables.contains(file)) continue;
      EXPECT_LT(lines_of(kRoot / file).size(), kMaxLines) << file;
    }
  }
}

TEST(Rooms, TopLevelFoldersAreTheRooms) {
  std::set<std::string> folders;
  for (const auto& entry : fs::directory_iterator(kRoot)) {
    const std::string name = entry.path().filename().string();
    const bool made_by_tools = name == "build" || name == "node_modules";
    if (entry.is_directory() && !name.starts_with('.') && !made_by_tools) folders.insert(name);
  }
  EXPECT_THAT(folders, testing::UnorderedElementsAre("client", "core", "docker", "proto", "server", "tests"));
}

}  // namespace
