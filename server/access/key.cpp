#include "server/access/key.h"

#include <fmt/format.h>
#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/rand.h>

#include <algorithm>
#include <cctype>

#include "core/base/text.h"

namespace creased {
namespace {

constexpr std::string_view kPrefix = "crk_";
constexpr std::size_t kIdBytes = 8, kSecretBytes = 32;

template <std::size_t size>
std::string random_hex() {
  std::array<unsigned char, size> bytes{};
  if (::RAND_bytes(bytes.data(), static_cast<int>(size)) != 1) throw std::runtime_error("cannot get random bytes");
  return crease::hex(bytes);
}

Sha256 sha256(std::string_view text) {
  Sha256 digest{};
  unsigned size = 0;
  if (::EVP_Digest(text.data(), text.size(), digest.data(), &size, ::EVP_sha256(), nullptr) != 1) {
    throw std::bad_alloc();
  }
  return digest;
}

/// The id in a key; empty when the text is not a key.
std::string id_of(std::string_view key) {
  if (!key.starts_with(kPrefix)) return {};
  key.remove_prefix(kPrefix.size());
  return std::string(key.substr(0, std::min(key.find('_'), std::size_t{64})));
}

}  // namespace

NewKey make_key(const std::string& name) {
  const std::string id = random_hex<kIdBytes>();
  const std::string text = fmt::format("{}{}_{}", kPrefix, id, random_hex<kSecretBytes>());
  return {text, {{"id", id}, {"name", name}, {"sha256", crease::hex(sha256(text))}}};
}

std::string without_secrets(std::string text) {
  for (auto at = text.find(kPrefix); at != std::string::npos; at = text.find(kPrefix, at)) {
    at = text.find('_', at + kPrefix.size());
    if (at == std::string::npos) break;
    const auto is_secret = [](unsigned char c) { return std::isalnum(c) != 0; };
    const auto start = text.begin() + static_cast<std::ptrdiff_t>(at) + 1;
    text.replace(start, std::find_if_not(start, text.end(), is_secret), "...");
  }
  return text;
}

KeyRing::KeyRing(std::vector<Key> keys) {
  for (Key& key : keys) {
    const std::string id = key.id;
    by_id_.emplace(id, std::make_shared<const Key>(std::move(key)));
  }
}

std::shared_ptr<const Key> KeyRing::with_id(const std::string& id) const {
  const auto found = by_id_.find(id);
  return found == by_id_.end() ? nullptr : found->second;
}

std::shared_ptr<const Key> KeyRing::find(std::string_view text) const {
  static const auto nobody = std::make_shared<const Key>();
  const auto found = by_id_.find(id_of(text));
  const auto& candidate = found == by_id_.end() ? nobody : found->second;
  const Sha256 given = sha256(text);
  const bool same = ::CRYPTO_memcmp(given.data(), candidate->hash.data(), given.size()) == 0;
  return same && candidate != nobody ? candidate : nullptr;
}

}  // namespace creased
