#pragma once

#include <chrono>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>

namespace creased {

/// Signs addresses, so that whoever has one can read what it names for some time, and nothing else. The signature is
/// HMAC-SHA-256 of the path and of all fields of the query, the time of expiry among them.
class LinkSigner {
 public:
  using Query = std::multimap<std::string, std::string>;

  // Fields of the query that a link has besides those of the call.
  static constexpr std::string_view kExpires = "expires";      ///< seconds since 1970
  static constexpr std::string_view kKey = "key";              ///< id of the key that made it; none without keys
  static constexpr std::string_view kSignature = "signature";  ///< 64 hexadecimal digits

  explicit LinkSigner(std::string secret) : secret_(std::move(secret)) {}

  /// \throw std::runtime_error when there are no random bytes
  static std::string fresh_secret();

  /// With the secret that is kept in this private folder, and made when there is none.
  /// \throw crease::Error store_unavailable
  static LinkSigner of_folder(const std::filesystem::path& folder);

  /// The id of the key that made a link; empty for none.
  static std::string key_of(const Query& query);

  std::string signature(std::string_view path, const Query& query) const;

  /// \throw crease::Error link_invalid for another path, query or signature than were signed, link_expired
  void check(std::string_view path, const Query& query, std::chrono::system_clock::time_point now) const;

 private:
  std::string secret_;
};

}  // namespace creased
