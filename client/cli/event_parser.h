#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace crease::client {

struct Event {
  std::string id, type, data;
};

/// Parses server-sent events [WHATWG HTML, 9.2.6] from pieces of any size. Skips comments. An `id` applies until the
/// next one.
class EventParser {
 public:
  /// Takes the next bytes and returns the events that they complete.
  std::vector<Event> feed(std::string_view bytes);

 private:
  void read_line(std::string_view line, std::vector<Event>& events);

  std::string buffer_, id_, type_, data_;
};

}  // namespace crease::client
