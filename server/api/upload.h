#pragma once

#include <openssl/evp.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "crease/v1/parameters.pb.h"
#include "server/store/store.h"
#include "server/transport/guarded_server.h"
#include "server/transport/library.h"

namespace creased {

/// A temporary file that counts and hashes the bytes written to it. The destructor removes it, unless it was renamed.
class UploadFile {
 public:
  /// \throw crease::Error store_unavailable
  explicit UploadFile(std::filesystem::path path);
  ~UploadFile();
  UploadFile(const UploadFile&) = delete;
  UploadFile& operator=(const UploadFile&) = delete;

  /// \throw crease::Error store_unavailable, storage_full
  void append(const char* data, std::size_t size);
  /// Closes the file and completes the hash.
  void finish();

  const std::filesystem::path& path() const { return path_; }
  std::uint64_t bytes() const { return bytes_; }
  /// The hash as 64 hexadecimal digits; valid after finish().
  const std::string& sha256() const { return sha256_; }

 private:
  std::filesystem::path path_;
  int file_ = -1;
  std::uint64_t bytes_ = 0;
  std::unique_ptr<EVP_MD_CTX, decltype(&::EVP_MD_CTX_free)> hash_;
  std::string sha256_;
};

/// What a client has uploaded: a mesh, and how to smooth it.
struct Submission {
  std::unique_ptr<UploadFile> mesh;
  std::unique_ptr<UploadFile> weights;  ///< a JSON array, not yet parsed; null for none
  std::string name;
  std::string format;  ///< empty: guess it from the name, then from the bytes
  crease::v1::Parameters parameters;
};

/// Reads the body of POST /v1/jobs: a multipart form, a protobuf message, or a mesh with the parameters in the query.
/// \throw crease::Error body_missing, content_type_unsupported, multipart_*, protobuf_invalid, json_invalid,
/// parameter_*, weights_invalid, payload_too_large, body_incomplete, request_timeout, mesh_empty, store_unavailable
Submission receive_submission(const Exchange& exchange, const httplib::Request& request,
                              const httplib::ContentReader& reader, Store& store);

}  // namespace creased
