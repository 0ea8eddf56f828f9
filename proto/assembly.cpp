#include "proto/assembly.h"

#include <limits>

#include "core/io/dropped_attributes.h"
#include "proto/convert.h"
#include "proto/parameter_table.h"
#include "proto/result_formats.h"

namespace crease {
namespace {

std::optional<MeshFormat> format_of(const Upload& upload) {
  if (upload.format.empty()) return format_from_filename(upload.name);
  const auto format = format_from_name(upload.format);
  if (!format) throw Error(code::kMeshFormatUnknown, "unknown mesh format '" + upload.format + "'");
  return format;
}

template <class Message>
Message parse_stored(std::string_view stored) {
  Message message;
  const bool fits = stored.size() <= static_cast<std::size_t>(std::numeric_limits<int>::max());
  if (stored.empty() || !fits || !message.ParseFromArray(stored.data(), static_cast<int>(stored.size()))) {
    throw Error(code::kResultDamaged, "the stored result of the job cannot be read");
  }
  return message;
}

LabelledMesh stored_result(std::string_view stored, bool measured) {
  auto message = parse_stored<v1::LabelledMesh>(stored);
  if (measured && message.measured_size() != message.positions_size()) {
    throw Error(code::kNotFound, "the job was made by a version that did not keep the measured positions");
  }
  if (measured) message.mutable_positions()->Swap(message.mutable_measured());
  message.clear_measured();
  return from_message(message);
}

const Format& format_of(const v1::EncodeTask& task, const Formats& formats) {
  const Format* format = find_by_name(formats, task.format());
  if (format == nullptr) throw Error(code::kOutputFormatUnknown, "unknown format '" + task.format() + "'");
  return *format;
}

Formats formats_of(v1::ResultPart part) {
  switch (part) {
    case v1::RESULT_PART_LABELS:
      return label_formats();
    case v1::RESULT_PART_RIDGES:
      return ridge_formats();
    case v1::RESULT_PART_REPORT:
      return report_formats();
    default:
      return mesh_formats();
  }
}

/// The format of an upload that is the one that was accepted. \throw Error upload_damaged
MeshFormat checked_format(const v1::InputFacts& input, std::string_view upload) {
  const auto format = format_from_name(input.format());
  if (format && sha256_hex(upload) == input.sha256()) return *format;
  throw Error(code::kUploadDamaged, "the upload is not the one that was accepted: its SHA-256 differs");
}

}  // namespace

CheckedInput check_upload(const Upload& upload) {
  return check_input(upload.bytes, format_of(upload), upload.limits, upload.weights, upload.threads);
}

void describe_upload(v1::InputFacts& facts, const std::string& name, std::uint64_t bytes, const std::string& sha256) {
  facts.set_name(name);
  facts.set_bytes(static_cast<std::uint32_t>(bytes));
  facts.set_sha256(sha256);
}

v1::Job settled(const v1::InputFacts& input, const v1::Parameters& asked, const std::vector<v1::Warning>& of_input) {
  std::vector<Warning> of_parameters;
  v1::Job job;
  *job.mutable_input() = input;
  *job.mutable_parameters() = resolve(asked, &of_parameters);
  job.set_id(job_fingerprint(job.input(), job.parameters()));
  *job.mutable_warnings() = {of_input.begin(), of_input.end()};
  for (const Warning& warning : of_parameters) *job.add_warnings() = to_message(warning);
  return job;
}

v1::Report make_report(const v1::Job& job, const JobOutput& output, const v1::Timings& timings) {
  v1::Report report;
  report.set_id(job.id());
  report.set_version(CREASE_VERSION);
  *report.mutable_input() = job.input();
  *report.mutable_parameters() = job.parameters();
  *report.mutable_result() = to_message(output.facts);
  *report.mutable_timings() = timings;
  for (const SweepRecord& record : output.sweeps) *report.add_sweeps() = to_message(record);
  *report.mutable_warnings() = job.warnings();
  for (const Warning& warning : output.warnings) add_once(to_message(warning), *report.mutable_warnings());
  return report;
}

nlohmann::ordered_json extras_of(const v1::Job& job) {
  return mesh_extras(job_fingerprint(job.input(), job.parameters()), job.parameters(), from_message(job.input()),
                     from_message(job.result()));
}

std::string encode(v1::ResultPart part, const Format& format, const LabelledMesh& result, const v1::Job& job,
                   double min_label, const MeshStyle& style) {
  if (part == v1::RESULT_PART_LABELS) return format.write_labels(result, min_label);
  if (part == v1::RESULT_PART_RIDGES) return format.write_ridges(result, extras_of(job));
  return format.write(result, extras_of(job), style);
}

std::string encode(const Format& format, const v1::Report& report) {
  return &format == &kProtobuf ? report.SerializeAsString() : json_text(report);
}

bool takes_over(const v1::InputFacts& input, const Format& format) {
  const std::vector<std::string> attributes(input.attributes().begin(), input.attributes().end());
  return format.write != nullptr && dropped_in(format, attributes).size() < attributes.size();
}

Appearance appearance_of(const v1::InputFacts& input, std::string_view upload) {
  constexpr std::size_t kNoLimit = kNone;
  return decode_mesh(upload, checked_format(input, upload), {kNoLimit, kNoLimit}).appearance;
}

std::string original(const v1::InputFacts& input, std::string_view upload, const LabelledMesh& result) {
  return encode_original(upload, checked_format(input, upload), result);
}

std::string encode_stored(const v1::EncodeTask& task, std::string_view stored, std::string_view upload) {
  const bool measured = task.part() == v1::RESULT_PART_MEASURED;
  if (task.format() == kOriginal) return original(task.job().input(), upload, stored_result(stored, measured));
  const Format& format = format_of(task, formats_of(task.part()));
  if (task.part() == v1::RESULT_PART_REPORT) return encode(format, parse_stored<v1::Report>(stored));
  LabelledMesh result = stored_result(stored, measured);
  if (task.has_upload()) result.appearance = appearance_of(task.job().input(), upload);
  return encode(task.part(), format, result, task.job(), task.min_label(),
                {task.ridge_lines(), task.compressed(), task.quantized()});
}

}  // namespace crease
