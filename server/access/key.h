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

/// What a caller may have and do; 0 for no limit per caller.
struct Limits {
  std::size_t max_queued = 0;  ///< queued jobs
  std::size_t max_upload_mb = 0;
  std::size_t max_faces = 0;
  std::size_t max_stored_mb = 0;
  std::size_t max_streams = 0;
  Rate requests;
  double jobs_per_minute = 0;
};

using Sha256 = std::array<unsigned char, 32>;

/// A key as the service stores it, with the hash of its text.
struct Key {
  std::string id;    ///< owner of the jobs made with the key
  std::string name;  ///< shown to people
  Sha256 hash{};
  bool metrics = false;  ///< may read GET /metrics
  Limits limits;
};

inline constexpr std::size_t kMaxKeyNameBytes = 100;

/// A new key, "crk_<id>_<secret>" with a secret of 256 random bits, and its entry for the key file.
struct NewKey {
  std::string text;
  nlohmann::ordered_json entry;
};
NewKey make_key(const std::string& name);

/// `text` with the secrets of any keys removed, for logs.
std::string without_secrets(std::string text);

/// The keys of a service.
class KeyRing {
 public:
  KeyRing() = default;
  explicit KeyRing(std::vector<Key> keys);

  /// The key with this text; null when there is none. Takes the same time in both cases.
  std::shared_ptr<const Key> find(std::string_view text) const;
  /// The key with this id; null when there is none.
  std::shared_ptr<const Key> with_id(const std::string& id) const;
  bool has(const std::string& id) const { return by_id_.contains(id); }
  std::size_t size() const { return by_id_.size(); }

 private:
  std::unordered_map<std::string, std::shared_ptr<const Key>> by_id_;
};

class KeyFileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Reads a key file {"keys": [entry, …]}. An entry takes the limits that it does not set from `defaults`, and may not
/// exceed their max_upload_mb and max_faces.
/// \throw KeyFileError for the first faulty entry or member, and when other users can write the file
KeyRing read_keys(const std::filesystem::path& file, const Limits& defaults);

/// Whether other users than its owner can read the file.
bool readable_by_others(const std::filesystem::path& file);

/// Adds an entry to a key file, creating the file if it does not exist. The file changes completely or not at all.
/// \throw KeyFileError
void add_key(const std::filesystem::path& file, const nlohmann::ordered_json& entry);

}  // namespace creased
