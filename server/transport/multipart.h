#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace creased {

/// The boundary in a multipart/form-data Content-Type. \throw crease::Error multipart_invalid
std::string multipart_boundary(std::string_view content_type);

/// Parses multipart/form-data [RFC 7578] as it arrives. It buffers no more than a boundary and the headers of one part;
/// cpp-httplib's own reader buffers everything after the last boundary.
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
  /// Call after the last byte. \throw crease::Error multipart_invalid when the closing boundary is missing
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
