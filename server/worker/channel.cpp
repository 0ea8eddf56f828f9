#include "server/worker/channel.h"

#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <climits>
#include <cstring>
#include <string>

#include "core/error.h"
#include "server/base/failure.h"

namespace creased {
namespace code = crease::code;
namespace {

constexpr std::size_t kLongestMessage = 128 * 1024, kMostFiles = 8;

struct ControlBuffer {
  alignas(cmsghdr) std::array<char, CMSG_SPACE(kMostFiles * sizeof(int))> bytes{};
};

void attach(msghdr& head, ControlBuffer& control, std::span<const int> files) {
  head.msg_control = control.bytes.data();
  head.msg_controllen = CMSG_SPACE(files.size_bytes());
  cmsghdr* const part = CMSG_FIRSTHDR(&head);
  part->cmsg_level = SOL_SOCKET;
  part->cmsg_type = SCM_RIGHTS;
  part->cmsg_len = CMSG_LEN(files.size_bytes());
  std::memcpy(CMSG_DATA(part), files.data(), files.size_bytes());
}

std::vector<Descriptor> attached(msghdr& head) {
  std::vector<Descriptor> files;
  for (cmsghdr* part = CMSG_FIRSTHDR(&head); part != nullptr; part = CMSG_NXTHDR(&head, part)) {
    if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_RIGHTS) continue;
    std::vector<int> numbers((part->cmsg_len - CMSG_LEN(0)) / sizeof(int));
    std::memcpy(numbers.data(), CMSG_DATA(part), numbers.size() * sizeof(int));
    for (const int number : numbers) files.emplace_back(number);
  }
  return files;
}

bool wait_readable(int channel, std::optional<std::chrono::steady_clock::time_point> deadline) {
  using std::chrono::milliseconds;
  pollfd event{.fd = channel, .events = POLLIN, .revents = 0};
  for (;;) {
    int timeout_ms = -1;
    if (deadline) {
      const auto left = std::chrono::ceil<milliseconds>(*deadline - std::chrono::steady_clock::now()).count();
      timeout_ms = static_cast<int>(std::clamp<std::int64_t>(left, 0, INT_MAX));
    }
    const int ready = ::poll(&event, 1, timeout_ms);
    if (ready > 0) return true;
    if (ready == 0) return false;
  }
}

}  // namespace

std::pair<Descriptor, Descriptor> make_channel() {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    throw crease::Error(code::kProcessUnavailable, "cannot make a socket pair: " + errno_text(errno));
  }
  return {Descriptor(ends[0]), Descriptor(ends[1])};
}

bool send_message(int channel, const google::protobuf::MessageLite& message, std::span<const int> files) {
  std::string bytes = message.SerializeAsString();
  bytes.insert(bytes.begin(), '\0');  // so that no packet is empty, which would look like the end
  iovec piece{.iov_base = bytes.data(), .iov_len = bytes.size()};
  msghdr head{};
  head.msg_iov = &piece;
  head.msg_iovlen = 1;
  ControlBuffer control;
  if (!files.empty()) attach(head, control, files);
  ssize_t sent = -1;
  do {
    sent = ::sendmsg(channel, &head, MSG_NOSIGNAL);
  } while (sent < 0 && errno == EINTR);
  return sent == static_cast<ssize_t>(bytes.size());
}

Receipt receive_message(int channel, google::protobuf::MessageLite& message,
                        std::optional<std::chrono::steady_clock::time_point> deadline, std::vector<Descriptor>* files) {
  if (!wait_readable(channel, deadline)) return Receipt::kNothing;
  std::string bytes(kLongestMessage + 1, '\0');
  iovec piece{.iov_base = bytes.data(), .iov_len = bytes.size()};
  ControlBuffer control;
  msghdr head{};
  head.msg_iov = &piece;
  head.msg_iovlen = 1;
  head.msg_control = control.bytes.data();
  head.msg_controllen = control.bytes.size();
  ssize_t count = -1;
  // A peer that closes with unread input causes one ECONNRESET, which arrives before the messages that it has sent.
  do {
    count = ::recvmsg(channel, &head, MSG_CMSG_CLOEXEC);
  } while (count < 0 && (errno == EINTR || errno == ECONNRESET));
  if (count <= 0) return Receipt::kEnded;
  std::vector<Descriptor> received = attached(head);
  const bool whole = (static_cast<unsigned>(head.msg_flags) & (MSG_TRUNC | MSG_CTRUNC)) == 0;
  if (!whole || (files == nullptr && !received.empty())) return Receipt::kEnded;
  if (files != nullptr) *files = std::move(received);
  return message.ParseFromArray(bytes.data() + 1, static_cast<int>(count - 1)) ? Receipt::kMessage : Receipt::kEnded;
}

}  // namespace creased
