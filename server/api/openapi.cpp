#include "server/api/openapi.h"

#include <google/protobuf/descriptor.h>

#include <map>
#include <set>
#include <string>

#include "core/base/text.h"
#include "core/io/vertex_weights.h"
#include "crease/v1/job.pb.h"
#include "crease/v1/result.pb.h"
#include "proto/error_table.h"
#include "proto/parameter_table.h"
#include "proto/result_formats.h"
#include "server/api/results.h"
#include "server/api/routes.h"

namespace creased {
namespace code = crease::code;
namespace {

using Json = nlohmann::ordered_json;
using google::protobuf::FieldDescriptor;

// Problems that any call can have before it reaches its handler.
const std::vector<crease::ErrorCode> kCommonProblems = {code::kAddressConnectionsFull,
                                                        code::kExpectationFailed,
                                                        code::kHeadersTooLarge,
                                                        code::kHttpVersionUnsupported,
                                                        code::kInternal,
                                                        code::kContentEncodingUnsupported,
                                                        code::kMethodNotAllowed,
                                                        code::kNotFound,
                                                        code::kParameterUnknown,
                                                        code::kParameterInvalid,
                                                        code::kPayloadTooLarge,
                                                        code::kRequestMalformed,
                                                        code::kRequestTimeout,
                                                        code::kStoreUnavailable,
                                                        code::kTooManyConnections,
                                                        code::kTransferEncodingUnsupported,
                                                        code::kUriTooLong};

Json reference(const std::string& schema) { return {{"$ref", "#/components/schemas/" + schema}}; }

Json bytes_schema() { return {{"type", "string"}, {"format", "binary"}}; }

/// What the schema does not say of a text: words of a state, times.
Json text_schema(const FieldDescriptor& field) {
  if (field.name() == "state") {
    return {{"type", "string"}, {"enum", {"queued", "running", "succeeded", "failed", "cancelled"}}};
  }
  if (field.name().ends_with("_at")) return {{"type", "string"}, {"format", "date-time"}};
  return {{"type", "string"}};
}

Json field_schema(const FieldDescriptor& field) {
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return reference(field.message_type()->name());
    case FieldDescriptor::CPPTYPE_BOOL:
      return {{"type", "boolean"}};
    case FieldDescriptor::CPPTYPE_DOUBLE:
    case FieldDescriptor::CPPTYPE_FLOAT:
      return {{"type", "number"}};
    case FieldDescriptor::CPPTYPE_STRING:
      return text_schema(field);
    default:
      return {{"type", "integer"}, {"minimum", 0}};
  }
}

/// Whether JSON has the field even when it is empty. Of the messages inside others, a job without an end has no result,
/// one that did not fail no error, and so on.
bool is_always_there(const FieldDescriptor& field) {
  static const std::set<std::string> sometimes = {"result", "error", "choice", "energy", "uncertainty"};
  const bool message = field.message_type() != nullptr && !field.is_repeated();
  return message ? !sometimes.contains(field.name()) : !field.has_presence();
}

void add_message(const google::protobuf::Descriptor& message, Json& schemas) {
  if (schemas.contains(message.name())) return;
  Json& schema = schemas[message.name()] = {{"type", "object"}, {"properties", Json::object()}};
  Json required = Json::array();
  std::vector<const google::protobuf::Descriptor*> inner;
  for (int i = 0; i < message.field_count(); ++i) {
    const FieldDescriptor& field = *message.field(i);
    Json one = field_schema(field);
    schema["properties"][field.name()] = field.is_repeated() ? Json{{"type", "array"}, {"items", one}} : one;
    if (is_always_there(field)) required.push_back(field.name());
    if (field.message_type() != nullptr) inner.push_back(field.message_type());
  }
  if (!required.empty()) schema["required"] = std::move(required);
  for (const auto* next : inner) add_message(*next, schemas);
}

Json problem_schema() {
  Json codes = Json::array();
  for (const auto& kind : crease::error_table()) {
    if (kind.status != 0) codes.push_back(kind.name);
  }
  Json text = {{"type", "string"}};
  return {{"type", "object"},
          {"description", "A problem document (RFC 9457)."},
          {"required", {"type", "title", "status", "code"}},
          {"properties",
           {{"type", {{"type", "string"}, {"format", "uri-reference"}}},
            {"title", text},
            {"status", {{"type", "integer"}}},
            {"code", {{"type", "string"}, {"enum", codes}}},
            {"detail", text},
            {"place", text},
            {"field", text},
            {"value", text},
            {"expected", text},
            {"request_id", text}}}};
}

Json array_of(Json items) { return {{"type", "array"}, {"items", std::move(items)}}; }

/// Lists of so many numbers each: points, triangles, edges.
Json tuples(const std::string& type, int size) {
  return array_of({{"type", "array"}, {"items", {{"type", type}}}, {"minItems", size}, {"maxItems", size}});
}

/// A mesh in the format json.
Json mesh_schema() {
  const Json numbers = array_of({{"type", "number"}}), integers = array_of({{"type", "integer"}});
  return {{"type", "object"},
          {"required", {"positions", "triangles", "edges", "labels", "dihedral_deg", "extras"}},
          {"properties",
           {{"positions", tuples("number", 3)},
            {"triangles", tuples("integer", 3)},
            {"edges", tuples("integer", 2)},
            {"labels", numbers},
            {"dihedral_deg", numbers},
            {"classes", integers},
            {"segments", integers},
            {"sigma", numbers},
            {"extras", {{"type", "object"}}}}}};
}

Json link_schema() {
  return {{"type", "object"},
          {"required", {"url", "expires_at"}},
          {"properties",
           {{"url", {{"type", "string"}, {"format", "uri-reference"}}},
            {"expires_at", {{"type", "string"}, {"format", "date-time"}}}}}};
}

Json component_schemas(Json parameters) {
  Json schemas = Json::object();
  parameters.erase("$schema");
  parameters.erase("$id");
  schemas["Parameters"] = std::move(parameters);
  schemas["LabelledMesh"] = mesh_schema();
  schemas["EdgeLabels"] = labels_schema();
  schemas["RidgeLines"] = ridge_lines_schema();
  schemas["Problem"] = problem_schema();
  schemas["Link"] = link_schema();
  add_message(*crease::v1::JobList::descriptor(), schemas);
  add_message(*crease::v1::Report::descriptor(), schemas);
  return schemas;
}

Json query_parameter(const std::string& name, const std::string& meaning, Json schema) {
  return {{"name", name}, {"in", "query"}, {"description", meaning}, {"schema", std::move(schema)}};
}

Json field_as_schema(const QueryField& field) {
  Json schema = {{"type", field.type}};
  if (!field.values.empty()) schema["enum"] = field.values;
  if (field.type == "integer" || field.type == "number") {
    schema["minimum"] = field.min;
    schema["maximum"] = field.max;
  }
  return schema;
}

Json header_parameter(const std::string& name, const std::string& meaning) {
  return {{"name", name}, {"in", "header"}, {"description", meaning}, {"schema", {{"type", "string"}}}};
}

Json operation_parameters(const Route& route, const Json& of_jobs) {
  Json all = Json::array();
  if (const auto brace = route.path.find('{'); brace != std::string::npos) {
    const std::string name = route.path.substr(brace + 1, route.path.find('}') - brace - 1);
    all.push_back({{"name", name}, {"in", "path"}, {"required", true}, {"schema", {{"type", "string"}}}});
  }
  for (const auto& field : route.query) {
    Json parameter = query_parameter(field.name, field.meaning, field_as_schema(field));
    if (field.required) parameter["required"] = true;
    all.push_back(std::move(parameter));
  }
  if (route.operation == "watch_job") {
    all.push_back(header_parameter("Last-Event-ID", "Sends only what is newer than the event with this id."));
  }
  if (route.has_ranges()) {
    all.push_back(header_parameter("Range", "Bytes of the file, as in bytes=0-99."));
    all.push_back(header_parameter("If-None-Match", "ETag of a copy; the answer is 304 when it is current."));
  }
  if (!route.takes_parameters()) return all;
  all.push_back(header_parameter("Prefer", "wait=N delays the answer until the job ends, at most N seconds."));
  all.push_back(header_parameter("Idempotency-Key", "1 to 255 visible ASCII characters; makes a retry safe."));
  for (const auto& [name, schema] : of_jobs.at("properties").items()) {
    all.push_back(query_parameter(name, schema.at("description"), schema));
  }
  return all;
}

Json weights_schema() {
  return {{"type", "array"},
          {"description", "Weights of the likelihood, one per vertex. They override those in the mesh file."},
          {"items", {{"type", "number"}, {"minimum", 0}, {"maximum", crease::kMaxWeight}}}};
}

Json submit_body() {
  const Json bytes = {{"schema", bytes_schema()}};
  const Json parts = {{"mesh", bytes_schema()}, {"parameters", reference("Parameters")}, {"weights", weights_schema()}};
  Json content;
  content["multipart/form-data"]["schema"] = {{"type", "object"}, {"required", {"mesh"}}, {"properties", parts}};
  for (const auto* format : crease::formats_with(&crease::Format::read)) {
    content[std::string(format->media_types.front())] = bytes;
  }
  content["application/octet-stream"] = bytes;
  content[std::string(crease::kProtobuf.media_types.front())] = bytes;
  return {{"required", true}, {"content", content}};
}

Json header(const std::string& meaning, const std::string& type) {
  return {{"description", meaning}, {"schema", {{"type", type}}}};
}

Json required_header(const std::string& meaning, Json schema) {
  return {{"description", meaning}, {"required", true}, {"schema", std::move(schema)}};
}

Json content_schema(const std::string& type) {
  if (type.ends_with("json") && type.starts_with("application/")) return {{"type", "object"}};
  return type.starts_with("text/") ? Json{{"type", "string"}} : bytes_schema();
}

std::string tag(const Route& route) {
  if (route.has_ranges() || route.operation == "get_report") return "Results";
  return route.path.starts_with("/v1/jobs") ? "Jobs" : "Service";
}

/// Adds the headers that an answer of the route has when it succeeds.
void add_headers(const Route& route, const RouteAnswer& answer, Json& response) {
  if (route.takes_parameters()) {
    response["headers"]["Location"] =
        required_header("Path of the job.", {{"type", "string"}, {"format", "uri-reference"}});
    response["headers"]["Preference-Applied"] = header("wait=N where the answer waited for the end.", "string");
    response["headers"]["Idempotent-Replayed"] = header("true when the key had already made this job.", "boolean");
  }
  const Json text = {{"type", "string"}};
  if (route.has_ranges())
    response["headers"]["ETag"] = header("Changes with the content; none for snapshots.", "string");
  if (answer.status == 304) return;
  if (tag(route) == "Results") response["headers"]["Content-Disposition"] = required_header("Name of the file.", text);
  if (route.has_ranges()) {
    response["headers"]["Accept-Ranges"] = required_header("Ranges are in bytes.", {{"const", "bytes"}});
  }
  if (answer.status == 206) {
    response["headers"]["Content-Range"] =
        required_header("The bytes of the answer, and how many there are.",
                        {{"type", "string"}, {"pattern", "^bytes [0-9]+-[0-9]+/[0-9]+$"}});
  }
}

Json success(const Route& route, const RouteAnswer& answer) {
  Json response = {{"description", answer.meaning}};
  for (const auto& type : answer.media_types) {
    const bool typed = type == "application/json" && !answer.schema.empty();
    response["content"][type]["schema"] = typed ? reference(answer.schema) : content_schema(type);
  }
  add_headers(route, answer, response);
  return response;
}

/// Problems of access: key, rate, origin.
std::vector<crease::ErrorCode> access_problems(const Route& route) {
  std::vector<crease::ErrorCode> codes;
  if (route.access == Access::kKey || route.access == Access::kMetrics) codes.push_back(code::kUnauthorized);
  if (route.access != Access::kProbe) codes.push_back(code::kRateLimited);
  if (route.method != "GET") codes.push_back(code::kOriginNotAllowed);
  return codes;
}

/// Adds the headers that a refusal with this status has.
void add_headers(int status, Json& response) {
  if (status == 401) response["headers"]["WWW-Authenticate"] = required_header("Bearer.", {{"type", "string"}});
  if (status == 405) response["headers"]["Allow"] = required_header("The methods of the path.", {{"type", "string"}});
  if (status == 429 || status == 503) {
    response["headers"]["Retry-After"] =
        required_header("Seconds to wait before trying again.", {{"type", "integer"}, {"minimum", 1}});
  }
}

Json problems(const Route& route) {
  std::map<int, std::set<std::string_view>> by_status;
  const std::vector<crease::ErrorCode> of_access = access_problems(route);
  for (const auto* codes : {&route.problems, &kCommonProblems, &of_access}) {
    for (const auto code : *codes) {
      const auto& kind = crease::error_kind(code);
      by_status[kind.status].insert(kind.name);
    }
  }
  Json responses = Json::object();
  for (const auto& [status, codes] : by_status) {
    std::string description;
    for (const auto name : codes) description.append(description.empty() ? "" : ", ").append(name);
    responses[std::to_string(status)] = {
        {"description", description},
        {"content", {{"application/problem+json", {{"schema", reference("Problem")}}}}},
        {"x-codes", codes}};
    add_headers(status, responses[std::to_string(status)]);
  }
  return responses;
}

/// A key; or nothing, on a server without keys or for a route that needs none.
Json security(const Route& route) {
  const Json key = {{"key", Json::array()}}, nothing = Json::object();
  if (route.access == Access::kOpen || route.access == Access::kProbe) return Json::array({nothing});
  return Json::array({key, nothing});
}

Json operation(const Route& route, const Json& parameters) {
  Json one = {{"operationId", route.operation},
              {"summary", route.summary},
              {"description", route.summary + "."},
              {"tags", {tag(route)}},
              {"parameters", operation_parameters(route, parameters)}};
  one["security"] = security(route);
  if (route.takes_parameters()) one["requestBody"] = submit_body();
  for (const auto& answer : route.answers) one["responses"][std::to_string(answer.status)] = success(route, answer);
  one["responses"].update(problems(route));
  return one;
}

}  // namespace

nlohmann::ordered_json openapi_document(const crease::OperatorSettings& settings) {
  const Json parameters = crease::parameters_schema(settings);
  Json document = {{"openapi", "3.1.0"},
                   {"info",
                    {{"title", "creased"},
                     {"version", CREASE_VERSION},
                     {"summary", "Removes noise from triangle meshes, keeps their ridges, and labels them."},
                     {"description", "Submit a mesh as a job, follow it, and download the result in any format."},
                     {"license", {{"name", "MIT"}, {"identifier", "MIT"}}}}},
                   {"servers", {{{"url", "/"}}}},
                   {"tags",
                    {{{"name", "Jobs"}, {"description", "Submit, list, follow, cancel and delete jobs."}},
                     {{"name", "Results"}, {"description", "Download what a job has made."}},
                     {{"name", "Service"}, {"description", "Parameters, health, metrics, documents and the page."}}}}};
  for (const auto& route : routes())
    document["paths"][route.path][crease::lower(route.method)] = operation(route, parameters);
  document["components"]["schemas"] = component_schemas(parameters);
  document["components"]["securitySchemes"]["key"] = {
      {"type", "http"},
      {"scheme", "bearer"},
      {"description",
       "A key made by `creased key`, needed when the service has keys. A key cannot see the jobs of other keys."}};
  return document;
}

}  // namespace creased
