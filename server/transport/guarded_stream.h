#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "core/error_code.h"
#include "server/transport/http_head.h"
#include "server/transport/library.h"

namespace creased {

struct StreamLimits {
  HeadLimits head;
  std::chrono::milliseconds head_timeout{10'000};   ///< from the first byte of a head to its last
  std::chrono::milliseconds body_timeout{30'000};   ///< for a pause in a body, and for a body as a whole
  std::uint64_t body_bytes_per_second = 4096;       ///< received bytes that extend this by one second
  std::chrono::milliseconds idle_timeout{60'000};   ///< between two requests on a connection
  std::chrono::milliseconds write_timeout{30'000};  ///< for a client that stops reading an answer
};

/// The socket of one connection, as cpp-httplib sees it. The framing is done here: the head is read whole, checked, and
/// limited in time and size; the library then reads exactly the bytes of the body, with chunks decoded, and an end of
/// file. So the body can never run into the next request, and an unread rest of a body is never parsed as a request.
class GuardedStream final : public httplib::Stream {
 public:
  using Clock = std::chrono::steady_clock;

  GuardedStream(int socket, const StreamLimits& limits);

  /// Waits for the first byte of a request. Returns false when the client has disconnected or was idle for too long.
  bool await_request();
  /// \throw crease::Error request_timeout, headers_too_large, request_malformed, and what parse_head throws
  RequestHead read_head();
  /// Sets what the library reads next: `replay`, then the body that `head` announces, at most `max_body` bytes.
  void begin(const RequestHead& head, std::string replay, std::uint64_t max_body);

  /// Whether every byte of the body has been read.
  bool body_complete() const { return body_ == Body::kComplete; }
  /// What is wrong with the body: payload_too_large, body_incomplete or request_timeout.
  std::optional<crease::ErrorCode> body_fault() const { return body_fault_; }
  std::uint64_t body_bytes() const { return body_bytes_; }
  std::uint64_t bytes_written() const { return bytes_written_; }
  /// Sets a function that is called between two pieces of the body with the number of bytes read so far. When it
  /// returns false, the body ends with body_incomplete.
  void set_body_guard(std::function<bool(std::uint64_t)> guard) { body_guard_ = std::move(guard); }

  /// Whether the client has closed its end or the connection is broken.
  bool peer_gone() const;
  /// Closes the sending side, then reads and discards input for at most `time`. This lets a client that is still
  /// uploading read the answer; closing at once would reset its connection.
  void linger(std::chrono::milliseconds time);

  bool is_readable() const override { return true; }
  bool is_writable() const override;
  ssize_t read(char* data, size_t size) override;
  ssize_t write(const char* data, size_t size) override;
  using httplib::Stream::write;
  void get_remote_ip_and_port(std::string& ip, int& port) const override;
  void get_local_ip_and_port(std::string& ip, int& port) const override;
  int socket() const override { return socket_; }

 private:
  enum class Body { kFixed, kChunkHead, kChunkData, kChunkEnd, kComplete, kFaulty };
  enum class Fill { kData, kEnd, kTimeout };

  Fill fill(Clock::time_point deadline);
  std::string_view buffered() const { return std::string_view(buffer_).substr(offset_); }
  void consume(std::size_t bytes) { offset_ += bytes; }
  bool fill_body();
  /// Reads a line of the chunked coding, without its CRLF. Returns false when the body is faulty.
  bool chunk_line(std::string& line);
  bool next_chunk();
  bool finish_chunk();
  ssize_t read_body(char* data, size_t size);
  bool fault(crease::ErrorCode code);

  int socket_;
  const StreamLimits& limits_;
  std::string buffer_;  // received bytes; those before offset_ are used up
  std::size_t offset_ = 0;

  std::string replay_;
  std::size_t replay_offset_ = 0;
  Body body_ = Body::kComplete;
  std::optional<crease::ErrorCode> body_fault_;
  std::uint64_t remaining_ = 0;  // bytes left of the body or chunk
  std::uint64_t max_body_ = 0;
  std::uint64_t body_bytes_ = 0;
  std::uint64_t bytes_written_ = 0;
  Clock::time_point body_start_;
  std::function<bool(std::uint64_t)> body_guard_;
};

}  // namespace creased
