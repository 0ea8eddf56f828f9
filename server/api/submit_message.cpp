#include "server/api/submit_message.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl.h>

#include <algorithm>
#include <bit>

#include "core/error.h"
#include "core/io/vertex_weights.h"
#include "crease/v1/job.pb.h"
#include "proto/parameter_table.h"
#include "server/base/durable_file.h"

namespace creased {
namespace code = crease::code;
namespace {

using crease::v1::SubmitJobRequest;

// A tag is the number of a field, and in its last three bits how its value is written. Strings, messages and packed
// numbers have their length in front. (https://protobuf.dev/programming-guides/encoding)
constexpr std::uint32_t kTypeBits = 3;
constexpr std::uint32_t kLengthDelimited = 2;

constexpr std::uint32_t kMaxTextBytes = 64 * 1024;

[[noreturn]] void invalid_message(const std::string& detail) { throw crease::Error(code::kProtobufInvalid, detail); }

class MessageReader {
 public:
  explicit MessageReader(google::protobuf::io::ZeroCopyInputStream& stream) : input_(&stream) {}

  /// The number of the next field; 0 at the end of the message.
  std::uint32_t next() {
    const std::uint32_t tag = input_.ReadTag();
    if (tag == 0) {
      if (!input_.ConsumedEntireMessage()) invalid_message("the message is malformed");
      return 0;
    }
    if ((tag & ((1U << kTypeBits) - 1)) != kLengthDelimited) {
      invalid_message("the message is not a crease.v1.SubmitJobRequest");
    }
    if (!input_.ReadVarint32(&length_)) invalid_message("the message ends early");
    return tag >> kTypeBits;
  }

  std::string text() {
    std::string bytes;
    if (length_ > kMaxTextBytes || !input_.ReadString(&bytes, static_cast<int>(length_))) {
      invalid_message("a field of the message is too long or ends early");
    }
    return bytes;
  }

  void copy_to(UploadFile& file) {
    std::uint32_t left = length_;
    while (left > 0) {
      const void* data = nullptr;
      int size = 0;
      if (!input_.GetDirectBufferPointer(&data, &size)) invalid_message("the mesh in the message ends early");
      const std::uint32_t count = std::min(left, static_cast<std::uint32_t>(size));
      file.append(static_cast<const char*>(data), count);
      input_.Skip(static_cast<int>(count));
      left -= count;
    }
  }

  void copy_numbers_to(UploadFile& file) {
    if (length_ % sizeof(double) != 0) invalid_message("the weights in the message are not packed doubles");
    const std::size_t count = length_ / sizeof(double);
    for (std::size_t i = 0; i < count; ++i) {
      std::uint64_t bits = 0;
      if (!input_.ReadLittleEndian64(&bits)) invalid_message("the weights in the message end early");
      const auto weight = std::bit_cast<double>(bits);
      if (!crease::is_weight(weight)) crease::fail_weight(i, weight);
      const std::string text = fmt::format("{}{}", i == 0 ? '[' : ',', weight);
      file.append(text.data(), text.size());
    }
    if (count > 0) file.append("]", 1);
  }

 private:
  google::protobuf::io::CodedInputStream input_;
  std::uint32_t length_ = 0;
};

}  // namespace

SubmitFields split_submit_message(const std::filesystem::path& message, UploadFile& mesh, UploadFile& weights) {
  const Descriptor file(::open(message.c_str(), O_RDONLY | O_CLOEXEC));
  google::protobuf::io::FileInputStream stream(file.get());
  MessageReader reader(stream);
  SubmitFields fields;
  std::uint32_t seen = 0;
  while (const std::uint32_t field = reader.next()) {
    if (SubmitJobRequest::descriptor()->FindFieldByNumber(static_cast<int>(field)) == nullptr) {
      invalid_message("the message has an unknown field " + std::to_string(field));
    }
    if ((seen & (1U << field)) != 0) invalid_message("a field of the message is repeated");
    seen |= 1U << field;
    if (field == SubmitJobRequest::kMeshFieldNumber) {
      reader.copy_to(mesh);
    } else if (field == SubmitJobRequest::kNameFieldNumber) {
      fields.name = reader.text();
    } else if (field == SubmitJobRequest::kFormatFieldNumber) {
      fields.format = reader.text();
    } else if (field == SubmitJobRequest::kWeightsFieldNumber) {
      reader.copy_numbers_to(weights);
    } else if (!fields.parameters.ParseFromString(reader.text())) {
      invalid_message("the parameters in the message are malformed");
    }
  }
  crease::validate(fields.parameters);
  return fields;
}

}  // namespace creased
