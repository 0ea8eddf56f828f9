#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "proto/error_table.h"
#include "server/transport/http_head.h"
#include "server/transport/multipart.h"
#include "tests/fuzz/http_service.h"
#include "tests/fuzz/lines.h"
#include "tests/fuzz/properties.h"
#include "tests/fuzz/strict_reader.h"
#include "tests/fuzz/target.h"
#include "tests/fuzz/targets.h"

namespace crease::fuzz {
namespace {

std::string written(const creased::RequestHead& head) {
  std::string text = head.method + " " + head.target + " " + head.version + "\r\n";
  for (const auto& [name, value] : head.headers) text.append(name).append(":").append(value).append("\r\n");
  return text + "\r\n";
}

bool is_same(const creased::RequestHead& a, const creased::RequestHead& b) {
  return a.method == b.method && a.target == b.target && a.version == b.version && a.headers == b.headers &&
         a.content_length == b.content_length && a.chunked == b.chunked && a.keep_alive == b.keep_alive &&
         a.expects_continue == b.expects_continue;
}

/// The result of parsing a form: its parts with their contents, or an error code.
struct Form {
  std::vector<std::pair<creased::MultipartReader::Part, std::string>> parts;
  std::optional<ErrorCode> refusal;
};

Form read_form(std::string_view boundary, std::string_view body, std::size_t piece) {
  Form form;
  creased::MultipartReader reader(boundary);
  reader.on_part = [&](const auto& part) { form.parts.emplace_back(part, ""); };
  reader.on_data = [&](std::string_view data) { form.parts.back().second += data; };
  try {
    for (; !body.empty(); body.remove_prefix(std::min(piece, body.size()))) reader.feed(body.substr(0, piece));
    reader.finish();
  } catch (const Error& error) {
    require_proper(error);
    form.refusal = error.code();
  }
  return form;
}

bool is_same(const Form& a, const Form& b) {
  return a.refusal == b.refusal && std::ranges::equal(a.parts, b.parts, [](const auto& x, const auto& y) {
           return x.first.name == y.first.name && x.first.file_name == y.first.file_name &&
                  x.first.content_type == y.first.content_type && x.second == y.second;
         });
}

void require_problem(const Answer& answer) {
  const auto problem = nlohmann::json::parse(answer.body);
  const ErrorKind* const kind = find_error_kind(problem.at("code").get<std::string>());
  require(kind != nullptr && kind->status == answer.status, "a problem is a row of the table of errors");
  require(kind->code != code::kInternal, "no request is a fault of ours");
}

std::vector<std::string> server_requests(const Conversation& conversation) {
  std::vector<std::string> requests;
  for (const auto& exchange : conversation.exchanges) {
    if (!exchange.method.empty()) requests.push_back(exchange.method + " " + exchange.target);
  }
  return requests;
}

/// Whether a served request is the one that was sent. Only the path remains of a target, without host and fragment.
bool is_one(const std::string& served, const std::string& sent) {
  const std::size_t target = sent.find(' ') + 1;
  const std::string whole = sent.substr(0, sent.find('#', target));
  return served == whole ||
         (whole.compare(target, 7, "http://") == 0 && served.compare(0, target, whole, 0, target) == 0);
}

bool is_prefix(const std::vector<std::string>& served, const std::vector<std::string>& sent) {
  return served.size() <= sent.size() && std::equal(served.begin(), served.end(), sent.begin(), is_one);
}

}  // namespace

void fuzz_http_head(std::string_view bytes) {
  creased::RequestHead head;
  if (refused([&] { head = creased::parse_head(bytes, {}); })) return;
  require(head.count("Content-Length") + head.count("Transfer-Encoding") <= 1, "the length of the body is told once");
  require(is_same(head, creased::parse_head(written(head), {1U << 20U, 1U << 20U})),
          "a head that was written reads back equal");
}

void fuzz_multipart(std::string_view bytes) {
  std::string boundary;
  const std::string_view type = take_line(bytes);
  if (refused([&] { boundary = creased::multipart_boundary(type); })) return;
  const Form whole = read_form(boundary, bytes, bytes.size());
  for (const std::size_t piece : {1U, 7U}) {
    require(is_same(whole, read_form(boundary, bytes, piece)), "a form is the same in pieces");
  }
}

void fuzz_http(std::string_view bytes) {
  const Conversation conversation = converse(bytes);
  require(is_prefix(server_requests(conversation), strict_requests(bytes)), "no request but those that were sent");
  std::vector<bool> to_head;
  for (const auto& exchange : conversation.exchanges) {
    require(exchange.status != 500, "no request is a fault of ours");
    to_head.push_back(exchange.method == "HEAD");
  }
  for (const Answer& answer : strict_answers(conversation.answers, to_head)) {
    if (answer.content_type == "application/problem+json" && !answer.body.empty()) require_problem(answer);
  }
}

}  // namespace crease::fuzz
