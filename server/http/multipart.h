#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace creased {

/// The boundary of a multipart/form-data type. \throw crease::Error multipart_invalid
std::string multipart_boundary(std::string_view content_type);

/// Takes multipart/form-data [RFC 7578] apart as it streams in, holding no more than a boundary and the headers of a
/// part. cpp-httplib's own reader keeps everything that follows the last boundary.
class MultipartReader {
 public:
  struct Part {
    std::string name;
    std::string file_name;
    std::string content_type;
  };

  explicit MultipartReader(std::string_view boundary);

  std::function<void(const Part&)> on_part;
  std::function<void(std::string_view)> on_data;

  /// \throw crease::Error multipart_invalid, and what the callbacks throw
  void feed(std::string_view data);
  /// After the last byte. \throw crease::Error multipart_invalid when the closing boundary is missing
  void finish() const;

 private:
  enum class State { kPreamble, kAfterBoundary, kHeaders, kData, kEpilogue };

  bool step();
  bool pass_data(bool report);
  bool after_boundary();
  bool headers();

  const std::string delimiter_;
  State state_ = State::kPreamble;
  std::string held_;
};

}  // namespace creased
