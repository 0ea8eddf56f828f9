#include "server/access/link_signer.h"

#include <fmt/format.h>
#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <openssl/rand.h>

#include <array>
#include <charconv>
#include <new>
#include <stdexcept>

#include "core/base/text.h"
#include "core/error.h"
#include "server/base/durable_file.h"
#include "server/base/failure.h"

namespace creased {
namespace code = crease::code;
namespace {

constexpr std::size_t kLinkSecretBytes = 32;

/// Every name and value with its length, so that no two queries have the same text.
std::string signed_text(std::string_view path, const LinkSigner::Query& query) {
  std::string text = fmt::format("{} {}\n", path.size(), path);
  for (const auto& [name, value] : query) {
    if (name != LinkSigner::kSignature) text += fmt::format("{} {} {} {}\n", name.size(), name, value.size(), value);
  }
  return text;
}

std::string link_field(const LinkSigner::Query& query, std::string_view name) {
  const auto found = query.find(std::string(name));
  return found == query.end() ? std::string() : found->second;
}

}  // namespace

std::string LinkSigner::fresh_secret() {
  std::array<unsigned char, kLinkSecretBytes> bytes{};
  if (::RAND_bytes(bytes.data(), static_cast<int>(bytes.size())) != 1) {
    throw std::runtime_error("cannot get random bytes");
  }
  return crease::hex(bytes);
}

LinkSigner LinkSigner::of_folder(const std::filesystem::path& folder) {
  const auto path = folder / "link-secret";
  if (!std::filesystem::exists(path)) {
    ReplacingFile file(path, "part");
    if (!write_all(file.descriptor(), fresh_secret())) throw file_failure("write", file.path());
    file.commit(Durability::kWhole);
  }
  std::string secret = read_whole(path);
  if (secret.size() != 2 * kLinkSecretBytes) {
    throw crease::Error(code::kStoreUnavailable, "the secret of links is damaged; remove " + path.string());
  }
  return LinkSigner(std::move(secret));
}

std::string LinkSigner::key_of(const Query& query) { return link_field(query, kKey); }

std::string LinkSigner::signature(std::string_view path, const Query& query) const {
  const std::string text = signed_text(path, query);
  std::array<unsigned char, 32> code{};
  unsigned size = 0;
  if (::HMAC(::EVP_sha256(), secret_.data(), static_cast<int>(secret_.size()),
             reinterpret_cast<const unsigned char*>(text.data()), text.size(), code.data(), &size) == nullptr) {
    throw std::bad_alloc();
  }
  return crease::hex(code);
}

void LinkSigner::check(std::string_view path, const Query& query, std::chrono::system_clock::time_point now) const {
  const std::string given = link_field(query, kSignature), right = signature(path, query);
  if (given.size() != right.size() || ::CRYPTO_memcmp(given.data(), right.data(), right.size()) != 0) {
    throw crease::Error(code::kLinkInvalid, "the link was changed, or was not made by this service");
  }
  const std::string expires = link_field(query, kExpires);
  std::int64_t seconds = 0;
  std::from_chars(expires.data(), expires.data() + expires.size(), seconds);
  if (now >= std::chrono::system_clock::time_point(std::chrono::seconds(seconds))) {
    throw crease::Error(code::kLinkExpired, "the time of the link is over; ask for another");
  }
}

}  // namespace creased
