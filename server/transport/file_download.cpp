#include "server/transport/file_download.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <optional>
#include <vector>

#include "core/base/text.h"

namespace creased {
namespace code = crease::code;
namespace {

using crease::trimmed;

constexpr std::size_t kPiece = 256 * 1024;

struct ByteRange {
  std::uint64_t first = 0, count = 0;
};

std::optional<std::uint64_t> number(std::string_view text) {
  std::uint64_t value = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || stop != text.data() + text.size()) return std::nullopt;
  return value;
}

[[noreturn]] void unsatisfiable(httplib::Response& response, std::uint64_t bytes) {
  response.set_header("Content-Range", fmt::format("bytes */{}", bytes));
  throw crease::Error(code::kRangeNotSatisfiable, fmt::format("the file has {} bytes", bytes));
}

/// The range that `header` asks for; nullopt for the whole file.
std::optional<ByteRange> parse_range(std::string_view header, std::uint64_t bytes, httplib::Response& response) {
  if (!header.starts_with("bytes=") || header.find(',') != std::string_view::npos) return std::nullopt;
  header.remove_prefix(6);
  const auto dash = header.find('-');
  if (dash == std::string_view::npos) return std::nullopt;
  const std::string_view first_text = trimmed(header.substr(0, dash)), last_text = trimmed(header.substr(dash + 1));
  const auto first = number(first_text), last = number(last_text);
  if (first_text.empty()) {
    if (!last) return std::nullopt;
    if (*last == 0) unsatisfiable(response, bytes);
    const std::uint64_t count = std::min(*last, bytes);
    return ByteRange{bytes - count, count};
  }
  if (!first || (!last && !last_text.empty()) || (last && *last < *first)) return std::nullopt;
  if (*first >= bytes) unsatisfiable(response, bytes);
  const std::uint64_t end = last ? std::min(*last, bytes - 1) + 1 : bytes;
  return ByteRange{*first, end - *first};
}

bool matches(std::string_view list, std::string_view quoted) {
  while (!list.empty()) {
    const auto comma = std::min(list.find(','), list.size());
    std::string_view tag = trimmed(list.substr(0, comma));
    list.remove_prefix(std::min(comma + 1, list.size()));
    if (tag == "*") return true;
    if (tag.starts_with("W/")) tag.remove_prefix(2);
    if (tag == quoted) return true;
  }
  return false;
}

std::optional<ByteRange> wanted_range(const RequestHead& head, httplib::Response& response, const Download& download,
                                      std::string_view quoted) {
  if (head.count("Range") != 1 || head.method != "GET") return std::nullopt;
  if (head.count("If-Range") > 0 && (download.etag.empty() || head.header("If-Range") != quoted)) return std::nullopt;
  return parse_range(head.header("Range"), download.file->bytes, response);
}

}  // namespace

void send_file(const Exchange& exchange, httplib::Response& response, const Download& download) {
  const std::string quoted = "\"" + download.etag + "\"";
  response.set_header("Accept-Ranges", "bytes");
  if (!download.etag.empty()) {
    response.set_header("ETag", quoted);
    response.set_header("Cache-Control", "private, no-cache");
    if (matches(exchange.head.header("If-None-Match"), quoted)) {
      response.status = 304;
      return;
    }
  }
  const auto range = wanted_range(exchange.head, response, download, quoted);
  if (!download.disposition.empty()) response.set_header("Content-Disposition", download.disposition);
  response.status = range ? 206 : 200;
  const std::uint64_t start = range ? range->first : 0, count = range ? range->count : download.file->bytes;
  if (range) {
    response.set_header("Content-Range", fmt::format("bytes {}-{}/{}", start, start + count - 1, download.file->bytes));
  }
  if (count == 0) {
    response.set_content("", download.media_type);
    return;
  }
  const auto buffer = std::make_shared<std::vector<char>>(std::min<std::uint64_t>(kPiece, count));
  response.set_content_provider(
      count, download.media_type,
      [file = download.file, start, buffer](std::size_t offset, std::size_t left, httplib::DataSink& sink) {
        ssize_t read = 0;
        do {
          read = ::pread(file->descriptor.get(), buffer->data(), std::min(left, buffer->size()),
                         static_cast<off_t>(start + offset));
        } while (read < 0 && errno == EINTR);
        return read > 0 && sink.write(buffer->data(), static_cast<std::size_t>(read));
      });
}

}  // namespace creased
