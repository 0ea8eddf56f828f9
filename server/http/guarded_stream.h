#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "server/http/http_head.h"
#include "server/http/library.h"

namespace creased {

struct StreamLimits {
  HeadLimits head;
  std::chrono::milliseconds head_timeout{10'000};   ///< from the first byte of a head to its end, whatever trickles in
  std::chrono::milliseconds body_timeout{30'000};   ///< for a body, and for a pause in it
  std::uint64_t body_bytes_per_second = 4096;       ///< a longer body has so much longer
  std::chrono::milliseconds idle_timeout{60'000};   ///< between two requests of a connection
  std::chrono::milliseconds write_timeout{30'000};  ///< for a pause in an answer that the client does not take
};

/// The socket of one connection as cpp-httplib sees it. It frames requests itself: the head comes whole, checked and
/// bounded in time and size; of the body the library is given exactly the bytes that belong to it, chunks decoded and
/// counted, and then end of file. What follows can so never be taken for a part of it, nor its rest for a request.
class GuardedStream final : public httplib::Stream {
 public:
  using Clock = std::chrono::steady_clock;

  GuardedStream(int socket, const StreamLimits& limits);

  /// Waits for the first byte of a request. False: the client has gone or has been idle too long.
  bool await_request();
  /// \throw crease::Error request_timeout, headers_too_large, request_malformed and the rest of parse_head.
  RequestHead read_head();
  /// What the library reads next: `replay`, then the body that `head` announces, at most `max_body` bytes of it.
  void begin(const RequestHead& head, std::string replay, std::uint64_t max_body);

  /// Whether every byte of the body has been read.
  bool body_complete() const { return body_ == Body::kComplete; }
  /// Code of what is wrong with the body: payload_too_large, body_incomplete, request_timeout; empty: nothing yet.
  std::string_view body_fault() const { return body_fault_; }
  std::uint64_t body_bytes() const { return body_bytes_; }
  std::uint64_t bytes_written() const { return bytes_written_; }
  /// Asked between two pieces of the body, with its bytes so far; false ends it as body_incomplete.
  void set_body_guard(std::function<bool(std::uint64_t)> guard) { body_guard_ = std::move(guard); }

  /// Whether the client has closed its end or the connection has broken.
  bool peer_gone() const;
  /// Ends the sending side, then reads what still comes for at most `time`, so that a client in the middle of its
  /// upload reads the answer instead of a reset.
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
  /// A line of the chunked coding without its CRLF; false when the body has become faulty.
  bool chunk_line(std::string& line);
  bool next_chunk();
  bool finish_chunk();
  ssize_t read_body(char* data, size_t size);
  bool fault(std::string_view code);

  int socket_;
  const StreamLimits& limits_;
  std::string buffer_;  // received, from offset_ on not yet used
  std::size_t offset_ = 0;

  std::string replay_;
  std::size_t replay_offset_ = 0;
  Body body_ = Body::kComplete;
  std::string_view body_fault_;
  std::uint64_t remaining_ = 0;  // of the body or of the chunk
  std::uint64_t max_body_ = 0;
  std::uint64_t body_bytes_ = 0;
  std::uint64_t bytes_written_ = 0;
  Clock::time_point body_start_;
  std::function<bool(std::uint64_t)> body_guard_;
};

}  // namespace creased
