#pragma once

#include <condition_variable>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <semaphore>
#include <set>
#include <string>

#include "core/io/format.h"
#include "server/api/file_download.h"
#include "server/store/checked_files.h"
#include "server/store/store.h"

namespace creased {

/// Download files made from the results of jobs. Each is encoded once, when it is first requested, and kept beside the
/// result.
class ResultFiles {
 public:
  explicit ResultFiles(Store& store) : store_(store), checked_(store) {}

  /// The mesh of a job that succeeded.
  std::shared_ptr<const OpenFile> mesh(const crease::v1::Job& job, const crease::Format& format);
  /// The same with the measured positions. \throw crease::Error not_found for jobs of a version that did not keep them
  std::shared_ptr<const OpenFile> measured(const crease::v1::Job& job, const crease::Format& format);
  /// The last snapshot of a running job's mesh. \throw crease::Error snapshot_unavailable
  std::shared_ptr<const OpenFile> snapshot(const crease::v1::Job& job, const crease::Format& format);
  /// The edges with a label of at least `min`, of a job that succeeded.
  std::shared_ptr<const OpenFile> labels(const crease::v1::Job& job, const crease::Format& format, double min);
  /// The ridge lines of a job that succeeded.
  std::shared_ptr<const OpenFile> ridges(const crease::v1::Job& job, const crease::Format& format);

 private:
  using Encode = std::function<std::string(const crease::LabelledMesh&)>;
  class Turn;

  std::shared_ptr<const OpenFile> kept(const crease::v1::Job& job, const std::string& name, const Encode& encode);
  crease::LabelledMesh result_of(const std::string& id);
  std::shared_ptr<const OpenFile> unkept(const std::string& bytes);

  Store& store_;
  CheckedFiles checked_;
  std::mutex mutex_;
  std::condition_variable finished_;
  std::set<std::string> under_way_;
  // At most two at a time, to bound the memory that downloads of large results need.
  std::counting_semaphore<> encoders_{2};
};

}  // namespace creased
