#pragma once

#include <string>
#include <string_view>
#include <vector>

/// Readers of both sides of a connection that share no code with the server and forgive nothing [RFC 9112].
namespace crease::fuzz {

/// "METHOD target" of every request that starts in `bytes`, up to the first fault: the most that a server may see.
std::vector<std::string> strict_requests(std::string_view bytes);

struct Answer {
  int status = 0;
  std::string content_type;
  std::string body;
};

/// The answers in `bytes`, interim ones left out. `to_head` tells of each in turn whether it answers a HEAD and so has
/// no body; the last may be cut off. \throw Violation for what is no HTTP
std::vector<Answer> strict_answers(std::string_view bytes, const std::vector<bool>& to_head);

}  // namespace crease::fuzz
