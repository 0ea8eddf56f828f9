#pragma once

#include <condition_variable>
#include <exception>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "core/io/formats.h"
#include "crease/v1/compute.pb.h"
#include "crease/v1/job.pb.h"
#include "server/base/durable_file.h"
#include "server/store/checked_files.h"
#include "server/store/store.h"
#include "server/worker/encoder.h"

namespace creased {

/// A part of a result in a format.
struct ResultFile {
  crease::v1::ResultPart part;
  const crease::Format& format;
  double min_label = 0;   ///< of labels: only edges with at least this
  bool original = false;  ///< of meshes: the upload, whose format `format` is, with other positions
  crease::MeshStyle style{};
};

/// What a style adds to the name of a file.
std::string style_suffix(const crease::MeshStyle& style);

/// The files that results are handed out in. They are encoded on first demand, in confined processes. Those of a whole
/// part are kept beside the job and count as its bytes. Those who ask for the same file share its encoding, which stops
/// when all of them have left.
class ResultFiles {
 public:
  ResultFiles(Store& store, Encoder& encoder) : store_(store), encoder_(encoder), checked_(store) {}

  /// The file of a job that succeeded, or the snapshot of one that runs. Waits while it is encoded.
  /// \throw crease::Error snapshot_unavailable, result_damaged, encoding_failed, job_not_found, storage_full,
  /// store_unavailable, process_unavailable
  std::shared_ptr<const OpenFile> file(const crease::v1::Job& job, const ResultFile& wanted,
                                       const TaskPool::Asker& asker);

  /// How many wait for the encoding of a file.
  std::size_t askers(const std::string& job, const std::string& name) const;

 private:
  struct UnderWay {
    std::size_t askers = 1;
    bool ended = false;
    std::shared_ptr<const OpenFile> file;
    std::exception_ptr error;
  };

  std::shared_ptr<const OpenFile> lead(UnderWay& mine, const std::string& key, const crease::v1::Job& job,
                                       const ResultFile& wanted, const TaskPool::Asker& asker);
  std::shared_ptr<const OpenFile> join(std::unique_lock<std::mutex>& lock, UnderWay& others,
                                       const TaskPool::Asker& asker);
  std::shared_ptr<const OpenFile> encode(const crease::v1::Job& job, const ResultFile& wanted,
                                         const TaskPool::Asker& asker);
  std::shared_ptr<const OpenFile> source(const crease::v1::Job& job, crease::v1::ResultPart part);
  void keep(const std::string& id, const std::string& name, const std::filesystem::path& path, int made);

  Store& store_;
  Encoder& encoder_;
  CheckedFiles checked_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, std::shared_ptr<UnderWay>> under_way_;  // by job and name
};

}  // namespace creased
