#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace crease::client {

struct Event {
  std::string id, type, data;
};

/// Server-sent events out of the bytes as they arrive, cut anywhere [WHATWG HTML, 9.2.6]. Comments are skipped; `id`
/// stays until another one comes.
class EventParser {
 public:
  /// The events that these bytes complete.
  std::vector<Event> feed(std::string_view bytes);

 private:
  void read_line(std::string_view line, std::vector<Event>& events);

  std::string buffer_, id_, type_, data_;
};

}  // namespace crease::client
