#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <set>

#include "server/access/key.h"
#include "server/base/durable_file.h"
#include "server/base/failure.h"

namespace creased {
namespace {

using Json = nlohmann::ordered_json;

/// Reads one entry of the file. Every member is read once, and unread members are an error.
class Entry {
 public:
  Entry(const Json& json, std::size_t index) : json_(json), where_(fmt::format("keys[{}]", index)) {
    if (!json.is_object()) fail("is not an object");
  }

  [[noreturn]] void fail(const std::string& what) const { throw KeyFileError(where_ + " " + what); }

  std::string text(const std::string& name) {
    known_.insert(name);
    const auto member = json_.find(name);
    if (member == json_.end() || !member->is_string()) fail("needs a string '" + name + "'");
    return member->get<std::string>();
  }

  bool flag(const std::string& name) {
    known_.insert(name);
    const auto member = json_.find(name);
    if (member == json_.end()) return false;
    if (!member->is_boolean()) fail("has a '" + name + "' that is not true or false");
    return member->get<bool>();
  }

  void count(const std::string& name, std::size_t& value, std::size_t max) {
    double number = static_cast<double>(value);
    if (!read(name, number)) return;
    if (number != std::floor(number) || number < 1 || number > static_cast<double>(max)) {
      fail(fmt::format("has {} = {}, expected a whole number from 1 to {}", name, number, max));
    }
    value = static_cast<std::size_t>(number);
  }

  void number(const std::string& name, double& value, double min) {
    constexpr double kMax = 1e6;
    if (read(name, value) && !(value >= min && value <= kMax)) {
      fail(fmt::format("has {} = {}, expected a number from {} to {}", name, value, min, kMax));
    }
  }

  void finish() const {
    for (const auto& [name, value] : json_.items()) {
      if (!known_.contains(name)) fail("has a member '" + name + "', which is unknown");
    }
  }

 private:
  bool read(const std::string& name, double& value) {
    known_.insert(name);
    const auto member = json_.find(name);
    if (member == json_.end()) return false;
    if (!member->is_number()) fail("has a '" + name + "' that is not a number");
    value = member->get<double>();
    return true;
  }

  const Json& json_;
  std::string where_;
  std::set<std::string> known_;
};

Sha256 parse_hash(const Entry& entry, const std::string& text) {
  Sha256 hash{};
  const bool digits = text.size() == 2 * hash.size() && std::all_of(text.begin(), text.end(), [](unsigned char c) {
                        return std::isdigit(c) != 0 || (c >= 'a' && c <= 'f');
                      });
  if (!digits) entry.fail("has a sha256 that is not 64 hexadecimal digits in lower case");
  for (std::size_t i = 0; i < hash.size(); ++i) std::from_chars(&text[2 * i], &text[2 * i] + 2, hash[i], 16);
  return hash;
}

bool is_id(const std::string& id) {
  constexpr std::size_t kLongest = 64;
  return !id.empty() && id.size() <= kLongest &&
         std::all_of(id.begin(), id.end(), [](unsigned char c) { return std::isalnum(c) != 0; });
}

Limits read_limits(Entry& entry, const Limits& defaults) {
  constexpr std::size_t kMany = 1'000'000'000;
  constexpr double kSlowest = 0.001;
  Limits limits = defaults;
  entry.count("max_queued", limits.max_queued, kMany);
  entry.count("max_upload_mb", limits.max_upload_mb, defaults.max_upload_mb);
  entry.count("max_faces", limits.max_faces, defaults.max_faces);
  entry.count("max_stored_mb", limits.max_stored_mb, kMany);
  entry.count("max_streams", limits.max_streams, kMany);
  entry.number("requests_per_second", limits.requests.per_second, kSlowest);
  entry.number("burst", limits.requests.burst, 1);
  entry.number("jobs_per_minute", limits.jobs_per_minute, kSlowest);
  return limits;
}

Key read_key(const Json& json, std::size_t index, const Limits& defaults) {
  Entry entry(json, index);
  Key key;
  key.id = entry.text("id");
  if (!is_id(key.id)) entry.fail("has an id that is not 1 to 64 letters and digits");
  key.name = entry.text("name");
  if (key.name.empty() || key.name.size() > kMaxKeyNameBytes) entry.fail("has a name that is not 1 to 100 bytes");
  key.hash = parse_hash(entry, entry.text("sha256"));
  key.metrics = entry.flag("metrics");
  key.limits = read_limits(entry, defaults);
  entry.finish();
  return key;
}

/// Reads a key file and checks its outer form.
Json read_document(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(stream), {});
  if (!stream.good() && !stream.eof()) throw KeyFileError("the file cannot be read");
  Json document = Json::parse(text, nullptr, false);
  const bool formed = document.is_object() && document.size() == 1 && document.contains("keys");
  if (!formed || !document["keys"].is_array()) throw KeyFileError("the file is not JSON of the form {\"keys\": [...]}");
  return document;
}

mode_t mode_of(const std::filesystem::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) throw KeyFileError("the file does not exist or cannot be accessed");
  return status.st_mode;
}

}  // namespace

bool readable_by_others(const std::filesystem::path& file) { return (mode_of(file) & (S_IRGRP | S_IROTH)) != 0; }

KeyRing read_keys(const std::filesystem::path& file, const Limits& defaults) {
  if ((mode_of(file) & (S_IWGRP | S_IWOTH)) != 0) {
    throw KeyFileError("other users can write the file; run chmod 600 on it");
  }
  const Json document = read_document(file);
  std::vector<Key> keys;
  std::set<std::string> ids;
  for (const Json& entry : document["keys"]) {
    const std::size_t index = keys.size();
    keys.push_back(read_key(entry, index, defaults));
    if (!ids.insert(keys.back().id).second) {
      throw KeyFileError(fmt::format("keys[{}] has the same id as an earlier entry", index));
    }
  }
  return KeyRing(std::move(keys));
}

void add_key(const std::filesystem::path& file, const Json& entry) {
  Json document = std::filesystem::exists(file) ? read_document(file) : Json{{"keys", Json::array()}};
  document["keys"].push_back(entry);
  const std::string text = document.dump(2) + "\n";
  try {
    ReplacingFile replacing(std::filesystem::absolute(file), "new");
    if (::write(replacing.descriptor(), text.data(), text.size()) != static_cast<ssize_t>(text.size())) {
      throw file_failure("write", file);
    }
    replacing.commit(Durability::kWhole);
  } catch (const std::exception& error) {
    throw KeyFileError(error.what());
  }
}

}  // namespace creased
