#include "tests/fuzz/strict_reader.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <optional>
#include <regex>

#include "core/base/text.h"
#include "tests/fuzz/target.h"

namespace crease::fuzz {
namespace {

constexpr auto kNone = std::string_view::npos;

using Fields = std::multimap<std::string, std::string>;  // names in lower case

bool is_visible(std::string_view text) {
  return !text.empty() && std::ranges::all_of(text, [](unsigned char c) { return c > 0x20 && c < 0x7f; });
}

/// Takes a line and its CRLF; nullopt when there is no CRLF or a control character before it.
std::optional<std::string_view> next_line(std::string_view& rest) {
  const auto end = rest.find("\r\n");
  if (end == kNone) return std::nullopt;
  const std::string_view line = rest.substr(0, end);
  rest.remove_prefix(end + 2);
  const auto is_control = [](unsigned char c) { return (c < 0x20 && c != '\t') || c == 0x7f; };
  if (std::ranges::any_of(line, is_control)) return std::nullopt;
  return line;
}

std::optional<Fields> take_fields(std::string_view& rest) {
  Fields fields;
  while (const auto line = next_line(rest)) {
    if (line->empty()) return fields;
    const auto colon = line->find(':');
    if (colon == kNone || !is_visible(line->substr(0, colon))) return std::nullopt;
    fields.emplace(lower(std::string(line->substr(0, colon))), trimmed(line->substr(colon + 1)));
  }
  return std::nullopt;
}

bool take_bytes(std::string_view& rest, std::string_view digits, int base, std::string* taken = nullptr) {
  if (digits.empty() || digits.size() > 15) return false;
  const auto is_digit = [&](unsigned char c) { return base == 16 ? std::isxdigit(c) != 0 : std::isdigit(c) != 0; };
  if (!std::ranges::all_of(digits, is_digit)) return false;
  const std::size_t count = std::stoull(std::string(digits), nullptr, base);
  if (taken != nullptr) taken->append(rest.substr(0, count));
  const bool whole = count <= rest.size();
  rest.remove_prefix(std::min(count, rest.size()));
  return whole;
}

bool take_chunks(std::string_view& rest, std::string* taken = nullptr) {
  while (const auto line = next_line(rest)) {
    const std::string_view size = trimmed(line->substr(0, line->find(';')));
    if (line->starts_with(' ') || line->starts_with('\t') || !take_bytes(rest, size, 16, taken)) return false;
    if (size.find_first_not_of('0') == kNone) return take_fields(rest).has_value();
    if (!rest.starts_with("\r\n")) return false;
    rest.remove_prefix(2);
  }
  return false;
}

/// Returns false when no request can follow.
bool take_request_body(std::string_view& rest, const Fields& fields) {
  const auto length = fields.find("content-length"), encoding = fields.find("transfer-encoding");
  if (encoding != fields.end()) return lower(encoding->second) == "chunked" && take_chunks(rest);
  return length == fields.end() || take_bytes(rest, length->second, 10);
}

bool frames_clearly(const Fields& fields, std::string_view version) {
  const std::size_t lengths = fields.count("content-length"), encodings = fields.count("transfer-encoding");
  return lengths + encodings <= 1 && fields.count("host") <= 1 && (encodings == 0 || version == "HTTP/1.1") &&
         (fields.count("host") == 1 || version == "HTTP/1.0");
}

bool is_plain_number(const Fields& fields) {
  const auto length = fields.find("content-length");
  return length == fields.end() || (!length->second.empty() && std::ranges::all_of(length->second, [](unsigned char c) {
           return std::isdigit(c) != 0;
         }));
}

bool is_bodiless(int status) { return status == 204 || status == 304; }

/// Returns false when the answer is cut off.
bool take_answer_body(std::string_view& rest, const Fields& fields, std::string& body) {
  if (const auto length = fields.find("content-length"); length != fields.end()) {
    return take_bytes(rest, length->second, 10, &body);
  }
  if (fields.contains("transfer-encoding")) return take_chunks(rest, &body);
  body = rest;  // the body lasts until the end of the connection
  rest = {};
  return true;
}

}  // namespace

std::vector<std::string> strict_requests(std::string_view bytes) {
  std::vector<std::string> requests;
  while (true) {
    while (bytes.starts_with("\r\n")) bytes.remove_prefix(2);
    const auto line = next_line(bytes);
    if (!line) return requests;
    const auto first = line->find(' '), last = line->rfind(' ');
    if (first == kNone || first == last) return requests;
    const std::string_view method = line->substr(0, first), target = line->substr(first + 1, last - first - 1);
    const std::string_view version = line->substr(last + 1);
    if (!is_visible(method) || !is_visible(target)) return requests;
    const auto fields = take_fields(bytes);
    if (!fields || !frames_clearly(*fields, version) || !is_plain_number(*fields)) return requests;
    requests.push_back(std::string(method) + " " + std::string(target));
    if (!take_request_body(bytes, *fields)) return requests;
  }
}

std::vector<Answer> strict_answers(std::string_view bytes, const std::vector<bool>& to_head) {
  static const std::regex status_line("HTTP/1\\.1 ([1-5][0-9][0-9]) [ -~]+");
  std::vector<Answer> answers;
  while (!bytes.empty()) {
    const auto line = next_line(bytes);
    std::match_results<std::string_view::const_iterator> match;
    require(line && std::regex_match(line->begin(), line->end(), match, status_line), "an answer has a status line");
    Answer answer{std::stoi(match[1].str()), "", ""};
    const auto fields = take_fields(bytes);
    require(fields.has_value(), "an answer has proper headers");
    if (answer.status < 200) continue;
    require(answers.size() < to_head.size(), "there are no more answers than requests");
    require(fields->count("content-length") + fields->count("transfer-encoding") <= 1, "the length is told once");
    if (const auto type = fields->find("content-type"); type != fields->end()) answer.content_type = type->second;
    const bool has_body = !to_head[answers.size()] && !is_bodiless(answer.status);
    const bool whole = !has_body || take_answer_body(bytes, *fields, answer.body);
    require(whole || bytes.empty(), "only the end of the connection cuts an answer off");
    if (!whole) return answers;
    answers.push_back(std::move(answer));
  }
  return answers;
}

}  // namespace crease::fuzz
