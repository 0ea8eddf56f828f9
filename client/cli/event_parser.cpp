#include "client/cli/event_parser.h"

namespace crease::client {

std::vector<Event> EventParser::feed(std::string_view bytes) {
  std::vector<Event> events;
  buffer_ += bytes;
  std::size_t start = 0;
  for (std::size_t end = buffer_.find('\n'); end != std::string::npos; end = buffer_.find('\n', start)) {
    std::string_view line(buffer_.data() + start, end - start);
    if (line.ends_with('\r')) line.remove_suffix(1);
    read_line(line, events);
    start = end + 1;
  }
  buffer_.erase(0, start);
  return events;
}

void EventParser::read_line(std::string_view line, std::vector<Event>& events) {
  if (line.empty()) {
    if (!data_.empty()) {
      data_.pop_back();
      events.push_back({id_, type_.empty() ? "message" : type_, data_});
    }
    type_.clear();
    data_.clear();
    return;
  }
  const auto colon = line.find(':');
  const std::string_view field = line.substr(0, colon);
  std::string_view value = colon == std::string_view::npos ? std::string_view() : line.substr(colon + 1);
  if (value.starts_with(' ')) value.remove_prefix(1);
  if (field == "id") id_ = value;
  if (field == "event") type_ = value;
  if (field == "data") data_.append(value).push_back('\n');
}

}  // namespace crease::client
