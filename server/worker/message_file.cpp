#include "server/worker/message_file.h"

#include <google/protobuf/io/zero_copy_stream_impl.h>

#include <cerrno>

#include "server/store/durable_file.h"
#include "server/store/failure.h"

namespace creased {

void write_message(const std::filesystem::path& path, std::string_view suffix,
                   const google::protobuf::MessageLite& message, bool durable) {
  constexpr int kBlockBytes = 1 << 20;
  ReplacingFile file(path, suffix);
  google::protobuf::io::FileOutputStream stream(file.descriptor(), kBlockBytes);
  if (!message.SerializeToZeroCopyStream(&stream) || !stream.Flush()) {
    errno = stream.GetErrno();
    throw file_failure("write", path);
  }
  file.commit(durable);
}

}  // namespace creased
