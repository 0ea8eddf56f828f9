#include "server/transport/guarded_stream.h"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>

#include "core/error.h"

namespace creased {
namespace code = crease::code;
namespace {

using std::chrono::milliseconds;

constexpr std::size_t kReceiveAtOnce = 64 * 1024;
constexpr std::size_t kMaxChunkLine = 256;  // a chunk's size and extensions, or one trailer
constexpr std::size_t kMaxTrailers = 32;

bool is_chunk_line(std::string_view line) {
  return std::all_of(line.begin(), line.end(), [](unsigned char c) { return c == '\t' || (c >= 0x20 && c != 0x7f); });
}

int wait_for(int socket, short events, milliseconds time) {
  pollfd entry{socket, events, 0};
  const int count = ::poll(&entry, 1, static_cast<int>(std::max(milliseconds(0), time).count()));
  return count < 0 && errno == EINTR ? 0 : count;
}

void address(int socket, int (*name_of)(int, sockaddr*, socklen_t*), std::string& ip, int& port) {
  sockaddr_storage storage{};
  socklen_t size = sizeof storage;
  if (name_of(socket, reinterpret_cast<sockaddr*>(&storage), &size) != 0) return;
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (storage.ss_family == AF_INET6) {
    const auto* v6 = reinterpret_cast<const sockaddr_in6*>(&storage);
    ip = ::inet_ntop(AF_INET6, &v6->sin6_addr, text.data(), text.size());
    port = ntohs(v6->sin6_port);
  } else if (storage.ss_family == AF_INET) {
    const auto* v4 = reinterpret_cast<const sockaddr_in*>(&storage);
    ip = ::inet_ntop(AF_INET, &v4->sin_addr, text.data(), text.size());
    port = ntohs(v4->sin_port);
  }
}

int peer_of(int socket, sockaddr* name, socklen_t* size) { return ::getpeername(socket, name, size); }
int self_of(int socket, sockaddr* name, socklen_t* size) { return ::getsockname(socket, name, size); }

}  // namespace

GuardedStream::GuardedStream(int socket, const StreamLimits& limits) : socket_(socket), limits_(limits) {}

GuardedStream::Fill GuardedStream::fill(Clock::time_point deadline) {
  if (offset_ > 0) {
    buffer_.erase(0, offset_);
    offset_ = 0;
  }
  while (true) {
    const auto left = std::chrono::ceil<milliseconds>(deadline - Clock::now());
    if (left <= milliseconds(0)) return Fill::kTimeout;
    if (wait_for(socket_, POLLIN, left) == 0) continue;
    const std::size_t held = buffer_.size();
    buffer_.resize(held + kReceiveAtOnce);
    const ssize_t count = ::recv(socket_, buffer_.data() + held, kReceiveAtOnce, MSG_DONTWAIT);
    buffer_.resize(held + static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
    if (count > 0) return Fill::kData;
    if (count == 0 || (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR)) return Fill::kEnd;
  }
}

bool GuardedStream::await_request() {
  return !buffered().empty() || fill(Clock::now() + limits_.idle_timeout) == Fill::kData;
}

RequestHead GuardedStream::read_head() {
  const auto deadline = Clock::now() + limits_.head_timeout;
  std::size_t searched = 0;
  while (true) {
    while (buffered().starts_with("\r\n")) {
      consume(2);
      searched = 0;
    }
    const auto end = buffered().find("\r\n\r\n", searched);
    if (std::min(end, buffered().size()) > limits_.head.max_bytes) {
      throw crease::Error(code::kHeadersTooLarge,
                          "the request head is longer than " + std::to_string(limits_.head.max_bytes) + " bytes");
    }
    if (end != std::string_view::npos) {
      const std::string bytes(buffered().substr(0, end + 4));
      consume(bytes.size());
      return parse_head(bytes, limits_.head);
    }
    searched = buffered().size() < 3 ? 0 : buffered().size() - 3;
    switch (fill(deadline)) {
      case Fill::kData:
        break;
      case Fill::kEnd:
        throw crease::Error(code::kRequestMalformed, "the connection closed before the end of the head");
      case Fill::kTimeout:
        throw crease::Error(code::kRequestTimeout, "the request head did not arrive in time");
    }
  }
}

void GuardedStream::begin(const RequestHead& head, std::string replay, std::uint64_t max_body) {
  replay_ = std::move(replay);
  replay_offset_ = 0;
  body_fault_ = {};
  body_bytes_ = bytes_written_ = 0;
  max_body_ = max_body;
  remaining_ = head.content_length.value_or(0);
  body_ = head.chunked ? Body::kChunkHead : remaining_ > 0 ? Body::kFixed : Body::kComplete;
  if (remaining_ > max_body_) fault(code::kPayloadTooLarge);
  body_start_ = Clock::now();
  body_guard_ = nullptr;
}

bool GuardedStream::fault(crease::ErrorCode code) {
  body_ = Body::kFaulty;
  body_fault_ = code;
  return false;
}

bool GuardedStream::fill_body() {
  const auto earned = std::chrono::seconds(body_bytes_ / std::max<std::uint64_t>(limits_.body_bytes_per_second, 1));
  const auto deadline = std::min(Clock::now(), body_start_ + earned) + limits_.body_timeout;
  switch (fill(deadline)) {
    case Fill::kData:
      return true;
    case Fill::kTimeout:
      return fault(code::kRequestTimeout);
    case Fill::kEnd:
      break;
  }
  return fault(code::kBodyIncomplete);
}

bool GuardedStream::chunk_line(std::string& line) {
  while (true) {
    const auto end = buffered().find("\r\n");
    if (std::min(end, buffered().size()) > kMaxChunkLine) return fault(code::kBodyIncomplete);
    if (end != std::string_view::npos) {
      line = buffered().substr(0, end);
      consume(end + 2);
      return true;
    }
    if (!fill_body()) return false;
  }
}

bool GuardedStream::next_chunk() {
  std::string line;
  if (!chunk_line(line)) return false;
  // A line feed alone, for example, would end the line for some proxies.
  if (!is_chunk_line(line)) return fault(code::kBodyIncomplete);
  std::string_view size_text = std::string_view(line).substr(0, line.find(';'));
  if (size_text.size() < line.size()) size_text = size_text.substr(0, size_text.find_last_not_of(" \t") + 1);
  const char* const end = size_text.data() + size_text.size();
  const auto [stop, error] = std::from_chars(size_text.data(), end, remaining_, 16);
  if (size_text.empty() || error != std::errc() || stop != end) return fault(code::kBodyIncomplete);
  if (remaining_ > max_body_ - body_bytes_) return fault(code::kPayloadTooLarge);
  if (remaining_ > 0) {
    body_ = Body::kChunkData;
    return true;
  }
  for (std::size_t trailers = 0; trailers < kMaxTrailers; ++trailers) {
    if (!chunk_line(line)) return false;
    if (line.empty()) {
      body_ = Body::kComplete;
      return true;
    }
    if (!is_field_line(line)) return fault(code::kBodyIncomplete);
  }
  return fault(code::kBodyIncomplete);
}

bool GuardedStream::finish_chunk() {
  while (buffered().size() < 2) {
    if (!fill_body()) return false;
  }
  if (!buffered().starts_with("\r\n")) return fault(code::kBodyIncomplete);
  consume(2);
  body_ = Body::kChunkHead;
  return true;
}

ssize_t GuardedStream::read_body(char* data, size_t size) {
  while (true) {
    switch (body_) {
      case Body::kComplete:
        return 0;
      case Body::kFaulty:
        return -1;
      case Body::kChunkHead:
        if (!next_chunk()) return -1;
        continue;
      case Body::kChunkEnd:
        if (!finish_chunk()) return -1;
        continue;
      case Body::kFixed:
      case Body::kChunkData:
        break;
    }
    if (buffered().empty() && !fill_body()) return -1;
    const auto count = static_cast<std::size_t>(std::min<std::uint64_t>({size, buffered().size(), remaining_}));
    std::memcpy(data, buffered().data(), count);
    consume(count);
    remaining_ -= count;
    body_bytes_ += count;
    if (remaining_ == 0) body_ = body_ == Body::kFixed ? Body::kComplete : Body::kChunkEnd;
    if (body_guard_ && !body_guard_(body_bytes_)) {
      fault(code::kBodyIncomplete);
      return -1;
    }
    return static_cast<ssize_t>(count);
  }
}

ssize_t GuardedStream::read(char* data, size_t size) {
  if (replay_offset_ == replay_.size()) return read_body(data, size);
  const std::size_t count = std::min(size, replay_.size() - replay_offset_);
  std::memcpy(data, replay_.data() + replay_offset_, count);
  replay_offset_ += count;
  return static_cast<ssize_t>(count);
}

ssize_t GuardedStream::write(const char* data, size_t size) {
  while (true) {
    const ssize_t count = ::send(socket_, data, size, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (count >= 0) {
      bytes_written_ += static_cast<std::uint64_t>(count);
      return count;
    }
    if (errno == EINTR) continue;
    if (errno != EAGAIN && errno != EWOULDBLOCK) return -1;
    if (wait_for(socket_, POLLOUT, limits_.write_timeout) <= 0) return -1;
  }
}

bool GuardedStream::is_writable() const {
  return wait_for(socket_, POLLOUT, limits_.write_timeout) > 0 && !peer_gone();
}

bool GuardedStream::peer_gone() const {
  pollfd entry{socket_, POLLRDHUP, 0};
  return ::poll(&entry, 1, 0) > 0 && (entry.revents & (POLLRDHUP | POLLHUP | POLLERR)) != 0;
}

void GuardedStream::linger(milliseconds time) {
  constexpr milliseconds kPause{500};
  ::shutdown(socket_, SHUT_WR);
  const auto deadline = Clock::now() + time;
  while (Clock::now() < deadline) {
    offset_ = buffer_.size();
    if (fill(std::min(deadline, Clock::now() + kPause)) != Fill::kData) return;
  }
}

void GuardedStream::get_remote_ip_and_port(std::string& ip, int& port) const { address(socket_, peer_of, ip, port); }

void GuardedStream::get_local_ip_and_port(std::string& ip, int& port) const { address(socket_, self_of, ip, port); }

}  // namespace creased
