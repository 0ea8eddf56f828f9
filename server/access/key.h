#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <unordered_map>

#include "server/access/rate_limiter.h"

namespace creased {

/// What a caller may have and do; 0: no bound of its own.
struct Limits {
  std::size_t max_queued = 0;  ///< jobs that wait
  std::size_t max_upload_mb = 0;
  std::size_t max_faces = 0;
  std::size_t max_stored_mb = 0;
  std::size_t max_streams = 0;
  Rate requests;
  double jobs_per_minute = 0;
};

using Sha256 = std::array<unsigned char, 32>;

/// A key as the service knows it: not what opens, only its hash.
struct Key {
  std::string id;    ///< owns the jobs; lasts as long as the key
  std::string name;  ///< for people
  Sha256 hash{};
  bool metrics = false;  ///< may read GET /metrics
  Limits limits;
};

inline constexpr std::size_t kMaxKeyNameBytes = 100;

/// A key that was just made, "crk_<id>_<secret>" with a secret of 256 random bits, and its entry for the file.
struct NewKey {
  std::string text;
  nlohmann::ordered_json entry;
};
NewKey make_key(const std::string& name);

/// `text` without the secrets of keys that may stand in it, for logs.
std::string without_secrets(std::string text);

/// The keys that a service knows.
class KeyRing {
 public:
  KeyRing() = default;
  explicit KeyRing(std::vector<Key> keys);

  /// The key that `text` opens; null: it is none, which takes as long to find out as that it is one.
  std::shared_ptr<const Key> find(std::string_view text) const;
  std::size_t size() const { return by_id_.size(); }

 private:
  std::unordered_map<std::string, std::shared_ptr<const Key>> by_id_;
};

class KeyFileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The keys of a file {"keys": [entry, …]}. Limits that an entry does not name are those of `defaults`, whose
/// max_upload_mb and max_faces no entry may exceed.
/// \throw KeyFileError naming entry and member of the first fault; when others than its owner can write the file
KeyRing read_keys(const std::filesystem::path& file, const Limits& defaults);

/// Whether others than its owner can read the file.
bool readable_by_others(const std::filesystem::path& file);

/// Adds an entry to a file of keys, made if it is not there, which changes whole or not at all. \throw KeyFileError
void add_key(const std::filesystem::path& file, const nlohmann::ordered_json& entry);

}  // namespace creased
