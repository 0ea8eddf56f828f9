#pragma once

#include <openssl/evp.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "crease/v1/parameters.pb.h"
#include "server/http/library.h"
#include "server/store/store.h"

namespace creased {

/// A file that bytes are streamed into while they are counted and hashed. Gone at the end unless another took it over.
class UploadFile {
 public:
  /// \throw crease::Error store_unavailable
  explicit UploadFile(std::filesystem::path path);
  ~UploadFile();
  UploadFile(const UploadFile&) = delete;
  UploadFile& operator=(const UploadFile&) = delete;

  /// \throw crease::Error store_unavailable, for instance when the disk is full
  void append(const char* data, std::size_t size);
  /// Closes the file and settles the hash.
  void finish();

  const std::filesystem::path& path() const { return path_; }
  std::uint64_t bytes() const { return bytes_; }
  /// 64 hexadecimal digits, after finish().
  const std::string& sha256() const { return sha256_; }

 private:
  std::filesystem::path path_;
  int file_ = -1;
  std::uint64_t bytes_ = 0;
  std::unique_ptr<EVP_MD_CTX, decltype(&::EVP_MD_CTX_free)> hash_;
  std::string sha256_;
};

/// What a client wants smoothed, and how.
struct Submission {
  std::unique_ptr<UploadFile> mesh;
  std::unique_ptr<UploadFile> weights;  ///< a JSON array, unread; null: none came beside the mesh
  std::string name;
  std::string format;  ///< empty: by the name, then by the bytes
  crease::v1::Parameters parameters;
};

/// Reads the body of POST /v1/jobs: multipart, protobuf, or the mesh itself with parameters in the query.
/// \throw crease::Error body_missing, content_type_unsupported, multipart_*, protobuf_invalid, json_invalid,
/// parameter_*, weights_invalid, payload_too_large, body_incomplete, request_timeout, mesh_empty, store_unavailable
Submission receive_submission(const httplib::Request& request, const httplib::ContentReader& body, Store& store);

}  // namespace creased
