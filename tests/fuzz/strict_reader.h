#pragma once

#include <string>
#include <string_view>
#include <vector>

// Strict readers for both sides of a connection [RFC 9112]. They share no code with the server.
namespace crease::fuzz {

/// "METHOD target" of every request in `bytes`, up to the first fault. A server may see no others.
std::vector<std::string> strict_requests(std::string_view bytes);

struct Answer {
  int status = 0;
  std::string content_type;
  std::string body;
};

/// The answers in `bytes`, without interim ones. `to_head` says for each whether it answers a HEAD request and so has
/// no body. The last may be cut off.
/// \throw Violation for bytes that are not HTTP
std::vector<Answer> strict_answers(std::string_view bytes, const std::vector<bool>& to_head);

}  // namespace crease::fuzz
