#include "server/api/upload.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>

#include "core/base/text.h"
#include "core/error.h"
#include "proto/parameter_table.h"
#include "proto/result_formats.h"
#include "server/api/submit_message.h"
#include "server/base/durable_file.h"
#include "server/transport/guarded_server.h"
#include "server/transport/multipart.h"

namespace creased {
namespace code = crease::code;
namespace {

using crease::equals_ignoring_case;
using crease::Error;
using crease::trimmed;
using nlohmann::json;

constexpr std::size_t kMaxParametersBytes = 64 * 1024;

bool is_protobuf(std::string_view type) { return crease::find_by_media_type({&crease::kProtobuf}, type) != nullptr; }

// Types that say nothing about the format. curl --data-binary sends form-urlencoded by default.
bool is_generic(std::string_view type) {
  return type.empty() || type == "application/octet-stream" || type == "application/x-www-form-urlencoded";
}

std::string upload_format(std::string_view media_type) {
  const auto* format = crease::find_by_media_type(crease::formats_with(&crease::Format::read), media_type);
  return std::string(format == nullptr ? "" : format->name);
}

/// The body of a request, which may turn out to be faulty while it is read.
class Body {
 public:
  Body(const httplib::ContentReader& reader, const GuardedStream& stream) : reader_(reader), stream_(stream) {}

  /// \throw Error payload_too_large, request_timeout, body_incomplete, and what `take` throws
  template <typename Take>
  void read(const Take& take) const {
    const bool read = reader_([&](const char* data, std::size_t size) {
      take(std::string_view(data, size));
      return true;
    });
    const auto fault = stream_.body_fault();
    if (fault == code::kPayloadTooLarge) throw Error(*fault, "the upload is larger than this server accepts");
    if (fault == code::kRequestTimeout) throw Error(*fault, "the body did not arrive in time");
    if (fault) throw Error(*fault, "the body is incomplete or its chunks are malformed");
    if (!read) throw Error(code::kBodyIncomplete, "the body ended early");
  }

 private:
  const httplib::ContentReader& reader_;
  const GuardedStream& stream_;
};

json parse_parameters(const std::string& text) {
  std::set<std::string> names;
  std::string repeated;
  const auto note_name = [&](int depth, json::parse_event_t event, json& parsed) {
    if (event == json::parse_event_t::key && depth == 1 && !names.insert(parsed.get<std::string>()).second) {
      repeated = parsed.get<std::string>();
    }
    return depth < 16;
  };
  json object = json::parse(text, note_name, false);
  if (!object.is_object()) throw Error(code::kJsonInvalid, "the parameters are not a JSON object");
  if (!repeated.empty()) throw Error::parameter(code::kParameterInvalid, repeated, "given twice", "a single value");
  return object;
}

void merge_parameters(crease::v1::Parameters& into, const crease::v1::Parameters& more) {
  std::vector<const google::protobuf::FieldDescriptor*> fields;
  more.GetReflection()->ListFields(more, &fields);
  for (const auto* field : fields) {
    if (into.GetReflection()->HasField(into, field)) {
      throw Error::parameter(code::kParameterInvalid, field->name(), "given twice",
                             "a single value, in the query or in the body");
    }
  }
  into.MergeFrom(more);
}

void read_query(const httplib::Request& request, Submission& submission) {
  for (const auto& [name, value] : request.params) {
    if (name == "name") {
      submission.name = value;
    } else if (name == "format") {
      submission.format = value;
    } else {
      crease::set_parameter(submission.parameters, name, value);
    }
  }
}

void settle_format(Submission& submission, const std::string& declared, std::string_view media_type) {
  if (declared.empty()) return;
  if (!submission.format.empty() && submission.format != declared) {
    throw Error::parameter(code::kParameterInvalid, "format", submission.format,
                           fmt::format("the format of the media type {}", media_type));
  }
  submission.format = declared;
}

void receive_raw(const Body& body, UploadFile& file) {
  body.read([&](std::string_view data) { file.append(data.data(), data.size()); });
}

/// Takes in the parts of a form.
class FormParts {
 public:
  FormParts(Store& store, Submission& submission) : store_(store), submission_(submission) {}

  void begin(const MultipartReader::Part& part) {
    if (part.name != "mesh" && part.name != "parameters" && part.name != "weights") {
      throw Error(code::kMultipartPartUnknown,
                  "unknown part '" + part.name + "', expected mesh, parameters or weights");
    }
    if (!seen_.insert(part.name).second) {
      throw Error(code::kMultipartInvalid, "the form has more than one part '" + part.name + "'");
    }
    file_ = part.name == "mesh" ? submission_.mesh.get() : nullptr;
    if (part.name == "weights") {
      submission_.weights = std::make_unique<UploadFile>(store_.temporary_path());
      file_ = submission_.weights.get();
    }
    if (part.name != "mesh") return;
    if (submission_.name.empty()) submission_.name = part.file_name;
    settle_format(submission_, upload_format(part.content_type), part.content_type);
  }

  void add(std::string_view data) {
    if (file_ != nullptr) return file_->append(data.data(), data.size());
    if (parameters_.size() + data.size() > kMaxParametersBytes) {
      throw Error(code::kJsonInvalid, "the parameters are too long");
    }
    parameters_ += data;
  }

  void finish() {
    if (!seen_.contains("mesh")) throw Error(code::kMultipartPartMissing, "the form has no part 'mesh'");
    if (!seen_.contains("parameters")) return;
    merge_parameters(submission_.parameters, crease::parameters_from_json(parse_parameters(parameters_)));
  }

 private:
  Store& store_;
  Submission& submission_;
  UploadFile* file_ = nullptr;  // of the current part; null when that is the parameters
  std::string parameters_;
  std::set<std::string> seen_;
};

void receive_multipart(std::string_view type, const Body& body, Store& store, Submission& submission) {
  MultipartReader reader(multipart_boundary(type));
  FormParts parts(store, submission);
  reader.on_part = [&](const MultipartReader::Part& part) { parts.begin(part); };
  reader.on_data = [&](std::string_view data) { parts.add(data); };
  body.read([&](std::string_view data) { reader.feed(data); });
  reader.finish();
  parts.finish();
}

void receive_protobuf(const Body& body, Store& store, Submission& submission) {
  UploadFile message(store.temporary_path());
  receive_raw(body, message);
  message.finish();
  auto weights = std::make_unique<UploadFile>(store.temporary_path());
  const SubmitFields fields = split_submit_message(message.path(), *submission.mesh, *weights);
  if (weights->bytes() > 0) submission.weights = std::move(weights);
  if (submission.name.empty()) submission.name = fields.name;
  settle_format(submission, fields.format, "in the message");
  merge_parameters(submission.parameters, fields.parameters);
}

}  // namespace

UploadFile::UploadFile(std::filesystem::path path)
    : path_(std::move(path)),
      file_(::open(path_.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0600)),
      hash_(::EVP_MD_CTX_new(), &::EVP_MD_CTX_free) {
  if (file_ < 0) throw file_failure("create", path_);
  if (hash_ == nullptr || ::EVP_DigestInit_ex(hash_.get(), ::EVP_sha256(), nullptr) != 1) throw std::bad_alloc();
}

UploadFile::~UploadFile() {
  if (file_ >= 0) ::close(file_);
  std::error_code ignored;
  std::filesystem::remove(path_, ignored);
}

void UploadFile::append(const char* data, std::size_t size) {
  ::EVP_DigestUpdate(hash_.get(), data, size);
  bytes_ += size;
  if (!write_all(file_, {data, size})) throw file_failure("write", path_);
}

void UploadFile::finish() {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  ::EVP_DigestFinal_ex(hash_.get(), digest.data(), &size);
  sha256_ = crease::hex({digest.data(), size});
  ::close(file_);
  file_ = -1;
}

Submission receive_submission(const Exchange& exchange, const httplib::Request& request,
                              const httplib::ContentReader& reader, Store& store) {
  if (!exchange.head.has_body()) throw Error(code::kBodyMissing, "send the mesh in the body");
  const Body body(reader, exchange.stream);
  Submission submission;
  read_query(request, submission);
  submission.mesh = std::make_unique<UploadFile>(store.temporary_path());

  const std::string_view header = exchange.head.header("Content-Type");
  const std::string_view type = trimmed(header.substr(0, header.find(';')));
  if (equals_ignoring_case(type, "multipart/form-data")) {
    receive_multipart(header, body, store, submission);
  } else if (is_protobuf(type)) {
    receive_protobuf(body, store, submission);
  } else if (is_generic(type) || !upload_format(type).empty()) {
    settle_format(submission, upload_format(type), type);
    receive_raw(body, *submission.mesh);
  } else {
    throw Error(code::kContentTypeUnsupported, "'" + std::string(type) + "' is not a media type for meshes");
  }
  submission.mesh->finish();
  if (submission.weights != nullptr) submission.weights->finish();
  if (submission.mesh->bytes() == 0) throw Error(code::kMeshEmpty, "the upload is empty");
  return submission;
}

}  // namespace creased
