#include "client/cli/service_client.h"

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>
#include <httplib.h>

// cpp-httplib includes resolv.h, which defines this macro; Eigen has parameters with the same name.
#undef _res

#include <algorithm>
#include <fstream>

#include "client/cli/failure.h"
#include "client/cli/files.h"
#include "proto/convert.h"

namespace crease::client {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::ordered_json;
using Receiver = std::function<bool(std::string_view)>;

constexpr auto kConnectTimeout = 5s;
constexpr auto kAnswerTimeout = 300s;  // the service inspects an upload before it answers
constexpr auto kRetryPause = 1s;
constexpr int kMaxRetries = 30;  // in a row, without an event from the server
constexpr std::size_t kPiece = std::size_t{256} * 1024;
constexpr int kNoContent = 204, kTooManyRequests = 429, kServiceUnavailable = 503;

std::string normal_url(std::string url) {
  while (url.ends_with('/')) url.pop_back();
  return url.find("://") == std::string::npos ? "http://" + url : url;
}

/// Where the path of a URL begins; its end when it has none.
std::size_t path_start(const std::string& url) { return std::min(url.find('/', url.find("://") + 3), url.size()); }

/// \throw Failure file_unreadable, usage when the file holds no key
std::string key_of(const Server& server) {
  if (!server.key.empty() || server.key_file.empty()) return server.key;
  const std::string text = read_file(server.key_file);
  std::string key = text.substr(0, text.find_first_of(" \t\r\n"));
  if (key.empty()) throw Failure(code::kUsage, fmt::format("{} does not start with a key", server.key_file.string()));
  return key;
}

bool is_success(int status) { return status >= 200 && status < 300; }

Json parse_answer(const std::string& text) {
  Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded()) throw Failure(code::kServerUnreachable, "the answer is not JSON; is this a creased server?");
  return json;
}

Query query_of(const v1::Parameters& parameters) {
  Query query;
  const Json json = to_json(parameters);
  for (const auto& [name, value] : json.items()) {
    query.emplace(name, value.is_string() ? value.get<std::string>() : value.dump());
  }
  return query;
}

/// A file that is uploaded in pieces.
class UploadStream {
 public:
  /// \throw Failure file_unreadable
  explicit UploadStream(const std::filesystem::path& path) : stream_(path, std::ios::binary), piece_(kPiece, '\0') {
    std::error_code error;
    bytes_ = std::filesystem::file_size(path, error);
    if (error || !stream_) throw Failure(code::kFileUnreadable, fmt::format("cannot read {}", path.string()));
  }

  std::uint64_t bytes() const { return bytes_; }

  /// The next piece; empty at the end.
  std::string_view next() {
    stream_.read(piece_.data(), static_cast<std::streamsize>(piece_.size()));
    return std::string_view(piece_).substr(0, static_cast<std::size_t>(stream_.gcount()));
  }

 private:
  std::ifstream stream_;
  std::string piece_;
  std::uint64_t bytes_ = 0;
};

httplib::Result post_raw(httplib::Client& http, const std::string& target, UploadStream& upload) {
  const std::string type = "application/octet-stream";
  if (upload.bytes() == 0) return http.Post(target, std::string(), type);
  const auto provide = [&](std::size_t, std::size_t length, httplib::DataSink& sink) {
    const std::string_view piece = upload.next().substr(0, length);
    return !piece.empty() && sink.write(piece.data(), piece.size());
  };
  return http.Post(target, upload.bytes(), provide, type);
}

httplib::Result post_form(httplib::Client& http, const std::string& target, UploadStream& upload,
                          const std::string& weights) {
  const auto provide = [&](std::size_t, httplib::DataSink& sink) {
    const std::string_view piece = upload.next();
    if (!piece.empty()) return sink.write(piece.data(), piece.size());
    sink.done();
    return true;
  };
  const httplib::MultipartFormDataItems texts = {{"weights", weights, "", "application/json"}};
  const httplib::MultipartFormDataProviderItems files = {{"mesh", provide, "", ""}};
  return http.Post(target, httplib::Headers(), texts, files);
}

}  // namespace

/// cpp-httplib's client, with its errors turned into Failure.
class ServiceClient::Connection {
 public:
  Connection(const Server& server, Interruption& interruption)
      : url_(normal_url(server.url)),
        prefix_(url_.substr(path_start(url_))),
        interruption_(interruption),
        http_(url_.substr(0, path_start(url_))) {
    if (!http_.is_valid()) throw Failure(code::kUsage, fmt::format("'{}' is not a valid server URL", server.url));
    if (const std::string key = key_of(server); !key.empty()) http_.set_bearer_token_auth(key);
    http_.set_connection_timeout(kConnectTimeout);
    http_.set_read_timeout(kAnswerTimeout);
    http_.set_tcp_nodelay(true);
    interruption_.set_action([this] { http_.stop(); });
  }
  ~Connection() { interruption_.set_action({}); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// The path and query of a call on this server.
  std::string target(const std::string& path, const Query& query = {}) const {
    return query.empty() ? prefix_ + path : httplib::append_query_params(prefix_ + path, query);
  }

  httplib::Client& http() {
    interruption_.check();
    return http_;
  }

  /// \throw Failure unless the call succeeded
  void require(const httplib::Result& result, const std::string& body) const {
    interruption_.check();
    if (!result) {
      throw Failure(code::kServerUnreachable, fmt::format("{}: {}", url_, httplib::to_string(result.error())));
    }
    if (is_success(result->status)) return;
    const Json problem = Json::parse(body, nullptr, false);
    if (problem.is_object() && problem.contains("code")) throw Failure(problem);
    throw Failure(code::kServerUnreachable,
                  fmt::format("{} answered {}; is this a creased server?", url_, result->status));
  }

  std::string body_of(const httplib::Result& result) const {
    require(result, result ? result->body : "");
    return result->body;
  }

  /// Passes the body of a successful answer to `receive` and puts any other into `refusal`.
  httplib::Result stream(const std::string& target, const httplib::Headers& headers, const Receiver& receive,
                         std::string& refusal) {
    bool success = false;
    return http().Get(
        target, headers, [&](const httplib::Response& response) { return success = is_success(response.status), true; },
        [&](const char* data, std::size_t size) {
          if (success) return receive({data, size});
          refusal.append(data, size);
          return true;
        });
  }

  void fetch(const std::string& path, const Query& query, const Receiver& receive) {
    std::string refusal;
    const auto result = stream(target(path, query), {}, receive, refusal);
    require(result, refusal);
  }

 private:
  std::string url_, prefix_;
  Interruption& interruption_;
  httplib::Client http_;
};

ServiceClient::ServiceClient(const Server& server, Interruption& interruption)
    : interruption_(interruption), connection_(std::make_unique<Connection>(server, interruption)) {}

ServiceClient::~ServiceClient() = default;

Json ServiceClient::submit(const std::filesystem::path& mesh, const std::string& format,
                           const std::filesystem::path& weights, const v1::Parameters& parameters) {
  Query query = query_of(parameters);
  query.emplace("name", mesh.filename().string());
  if (!format.empty()) query.emplace("format", format);
  const std::string target = connection_->target("/v1/jobs", query);
  UploadStream upload(mesh);
  httplib::Client& http = connection_->http();
  return parse_answer(connection_->body_of(weights.empty() ? post_raw(http, target, upload)
                                                           : post_form(http, target, upload, read_file(weights))));
}

Json ServiceClient::get(const std::string& path, const Query& query) { return parse_answer(download(path, query)); }

Json ServiceClient::post(const std::string& path) {
  return parse_answer(connection_->body_of(connection_->http().Post(connection_->target(path))));
}

void ServiceClient::remove(const std::string& path) {
  connection_->body_of(connection_->http().Delete(connection_->target(path)));
}

std::uint64_t ServiceClient::download(const std::string& path, const Query& query, const std::filesystem::path& file) {
  OutputFile output(file);
  std::uint64_t bytes = 0;
  connection_->fetch(path, query, [&](std::string_view piece) {
    bytes += piece.size();
    output.write(piece);
    return true;
  });
  output.commit();
  return bytes;
}

std::string ServiceClient::download(const std::string& path, const Query& query) {
  std::string body;
  connection_->fetch(path, query, [&](std::string_view piece) { return body += piece, true; });
  return body;
}

bool ServiceClient::listen(const std::string& id, std::string& last_event_id, Json& job,
                           const OnProgress& on_progress) {
  EventParser parser;
  bool ended = false;
  const auto on_event = [&](const Event& event) {
    last_event_id = event.id;
    if (event.type == "progress") return on_progress(from_json<v1::Progress>(parse_answer(event.data)));
    job = parse_answer(event.data);
    ended = true;
  };
  httplib::Headers headers;
  if (!last_event_id.empty()) headers.emplace("Last-Event-ID", last_event_id);
  std::string refusal;
  const auto result = connection_->stream(
      connection_->target("/v1/jobs/" + id + "/events"), headers,
      [&](std::string_view bytes) {
        for (const Event& event : parser.feed(bytes)) on_event(event);
        return !ended;
      },
      refusal);
  interruption_.check();
  if (ended) return true;
  if (!result || result->status == kServiceUnavailable || result->status == kTooManyRequests) return false;
  connection_->require(result, refusal);
  if (result->status != kNoContent) return false;
  job = get("/v1/jobs/" + id);  // the last event came before the connection was lost
  return true;
}

Json ServiceClient::follow(const std::string& id, const OnProgress& on_progress) {
  std::string last_event_id;
  Json job;
  for (int retries = 0; retries < kMaxRetries; ++retries) {
    const auto heard = [&](const v1::Progress& progress) {
      retries = 0;
      on_progress(progress);
    };
    if (listen(id, last_event_id, job, heard)) return job;
    if (interruption_.wait(kRetryPause)) interruption_.check();
  }
  throw Failure(code::kServerUnreachable, fmt::format("lost the events of job {} and could not reconnect", id));
}

template <typename Message>
Message from_json(const nlohmann::ordered_json& json) {
  google::protobuf::util::JsonParseOptions options;
  options.ignore_unknown_fields = true;
  Message message;
  const auto status = google::protobuf::util::JsonStringToMessage(json.dump(), &message, options);
  if (!status.ok()) throw Failure(code::kServerUnreachable, "the answer does not match the API: " + status.ToString());
  return message;
}

template v1::Job from_json(const nlohmann::ordered_json& json);
template v1::JobList from_json(const nlohmann::ordered_json& json);
template v1::Progress from_json(const nlohmann::ordered_json& json);

}  // namespace crease::client
