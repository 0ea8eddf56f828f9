#include "server/worker/frame.h"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <climits>
#include <cstdint>
#include <span>
#include <string>

namespace creased {
namespace {

using Deadline = std::optional<std::chrono::steady_clock::time_point>;

constexpr std::size_t kLengthBytes = 4;
constexpr std::uint32_t kLongest = 16U << 20U;

ssize_t write_some(int descriptor, std::string_view bytes) {
  const ssize_t sent = ::send(descriptor, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  if (sent < 0 && errno == ENOTSOCK) return ::write(descriptor, bytes.data(), bytes.size());
  return sent;
}

bool write_all(int descriptor, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = write_some(descriptor, bytes);
    if (written > 0) {
      bytes.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno != EINTR) {
      return false;
    }
  }
  return true;
}

bool wait_readable(int descriptor, const Deadline& deadline) {
  using std::chrono::milliseconds;
  if (!deadline) return true;
  pollfd event{.fd = descriptor, .events = POLLIN, .revents = 0};
  for (;;) {
    const auto left = std::chrono::ceil<milliseconds>(*deadline - std::chrono::steady_clock::now()).count();
    if (left <= 0) return false;
    if (::poll(&event, 1, static_cast<int>(std::min<std::int64_t>(left, INT_MAX))) > 0) return true;
  }
}

FrameOutcome read_all(int descriptor, std::span<char> bytes, const Deadline& deadline) {
  while (!bytes.empty()) {
    if (!wait_readable(descriptor, deadline)) return FrameOutcome::kTimedOut;
    const ssize_t count = ::read(descriptor, bytes.data(), bytes.size());
    if (count > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(count));
    } else if (count == 0 || errno != EINTR) {
      return FrameOutcome::kEnded;
    }
  }
  return FrameOutcome::kRead;
}

}  // namespace

bool write_frame(int descriptor, const google::protobuf::MessageLite& message) {
  const std::string body = message.SerializeAsString();
  std::string frame;
  for (std::size_t byte = 0; byte < kLengthBytes; ++byte) {
    frame.push_back(static_cast<char>((body.size() >> (byte * CHAR_BIT)) & UCHAR_MAX));
  }
  return write_all(descriptor, frame.append(body));
}

FrameOutcome read_frame(int descriptor, google::protobuf::MessageLite& message, Deadline deadline) {
  std::array<char, kLengthBytes> head{};
  if (const auto outcome = read_all(descriptor, head, deadline); outcome != FrameOutcome::kRead) return outcome;
  std::uint32_t length = 0;
  for (std::size_t byte = 0; byte < kLengthBytes; ++byte) {
    length |= static_cast<std::uint32_t>(static_cast<unsigned char>(head[byte])) << (byte * CHAR_BIT);
  }
  if (length > kLongest) return FrameOutcome::kEnded;
  std::string body(length, '\0');
  if (const auto outcome = read_all(descriptor, body, deadline); outcome != FrameOutcome::kRead) return outcome;
  return message.ParseFromString(body) ? FrameOutcome::kRead : FrameOutcome::kEnded;
}

}  // namespace creased
