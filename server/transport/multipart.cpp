#include "server/transport/multipart.h"

#include "core/base/text.h"
#include "core/error.h"
#include "server/transport/http_head.h"

namespace creased {
namespace code = crease::code;
namespace {

using crease::equals_ignoring_case;
using crease::trimmed;

constexpr std::size_t kMaxPartHead = 8 * 1024;

[[noreturn]] void invalid(const std::string& detail) { throw crease::Error(code::kMultipartInvalid, detail); }

/// The value of `name` in `type; name=value; other="value"`. A quoted value may contain escaped quotes.
std::string parameter_of(std::string_view field, std::string_view name) {
  auto rest = field.substr(std::min(field.find(';'), field.size()));
  while (rest.starts_with(';')) {
    rest.remove_prefix(1);
    const auto equals = std::min(rest.find_first_of("=;"), rest.size());
    const std::string_view key = trimmed(rest.substr(0, equals));
    rest.remove_prefix(equals);
    std::string value;
    if (rest.starts_with("=\"")) {
      std::size_t at = 2;
      for (; at < rest.size() && rest[at] != '"'; ++at) {
        if (rest[at] == '\\' && at + 1 < rest.size() && (rest[at + 1] == '"' || rest[at + 1] == '\\')) ++at;
        value += rest[at];
      }
      rest.remove_prefix(std::min(rest.find(';', at), rest.size()));
    } else if (rest.starts_with("=")) {
      const auto end = std::min(rest.find(';'), rest.size());
      value = trimmed(rest.substr(1, end - 1));
      rest.remove_prefix(end);
    }
    if (equals_ignoring_case(key, name)) return value;
  }
  return {};
}

MultipartReader::Part parse_part_head(std::string_view head) {
  MultipartReader::Part part;
  while (!head.empty()) {
    const auto end = std::min(head.find("\r\n"), head.size());
    const std::string_view line = head.substr(0, end);
    head.remove_prefix(std::min(end + 2, head.size()));
    const auto colon = line.find(':');
    if (colon == std::string_view::npos) invalid("a part has a malformed header");
    const std::string_view name = line.substr(0, colon), value = trimmed(line.substr(colon + 1));
    if (equals_ignoring_case(name, "Content-Type")) part.content_type = value.substr(0, value.find(';'));
    if (!equals_ignoring_case(name, "Content-Disposition")) continue;
    if (!equals_ignoring_case(trimmed(value.substr(0, value.find(';'))), "form-data"))
      invalid("a part does not have the Content-Disposition form-data");
    part.name = parameter_of(value, "name");
    part.file_name = parameter_of(value, "filename");
  }
  if (part.name.empty()) invalid("a part has no name");
  return part;
}

}  // namespace

std::string multipart_boundary(std::string_view content_type) {
  std::string boundary = parameter_of(content_type, "boundary");
  if (boundary.empty() || boundary.size() > 70) invalid("the Content-Type has no boundary of 1 to 70 characters");
  return boundary;
}

// The buffer starts with a line break, so that the first boundary looks like all others.
MultipartReader::MultipartReader(std::string_view boundary)
    : delimiter_("\r\n--" + std::string(boundary)), held_("\r\n") {}

void MultipartReader::feed(std::string_view data) {
  if (state_ == State::kEpilogue) return;
  held_ += data;
  while (step()) {
  }
}

void MultipartReader::finish() const {
  if (state_ != State::kEpilogue) invalid("the closing boundary is missing");
}

bool MultipartReader::step() {
  switch (state_) {
    case State::kPreamble:
      return pass_data(false);
    case State::kAfterBoundary:
      return after_boundary();
    case State::kHeaders:
      return headers();
    case State::kData:
      return pass_data(true);
    case State::kEpilogue:
      break;
  }
  held_.clear();
  return false;
}

bool MultipartReader::pass_data(bool report) {
  const auto found = held_.find(delimiter_);
  const std::size_t safe = held_.size() < delimiter_.size() ? 0 : held_.size() - delimiter_.size() + 1;
  const std::size_t size = found == std::string::npos ? safe : found;
  if (report && size > 0) on_data(std::string_view(held_).substr(0, size));
  held_.erase(0, found == std::string::npos ? size : size + delimiter_.size());
  if (found != std::string::npos) state_ = State::kAfterBoundary;
  return found != std::string::npos;
}

bool MultipartReader::after_boundary() {
  while (held_.starts_with(' ') || held_.starts_with('\t')) held_.erase(0, 1);
  if (held_.size() < 2) return false;
  if (held_.starts_with("--")) {
    state_ = State::kEpilogue;
  } else if (held_.starts_with("\r\n")) {
    state_ = State::kHeaders;  // keep the line break, so that an empty head also ends in two
  } else {
    invalid("a boundary is not followed by a line break");
  }
  return true;
}

bool MultipartReader::headers() {
  const auto end = held_.find("\r\n\r\n");
  if (std::min(end, held_.size()) > kMaxPartHead) invalid("the headers of a part are too long");
  if (end == std::string::npos) return false;
  const std::size_t start = std::min<std::size_t>(2, end);
  const Part part = parse_part_head(std::string_view(held_).substr(start, end - start));
  held_.erase(0, end + 4);
  on_part(part);
  state_ = State::kData;
  return true;
}

}  // namespace creased
