#pragma once

#include "server/api/call.h"
#include "server/api/result_files.h"

namespace creased {

/// Serves the results of a job: mesh, labels, ridge lines and report.
class Downloads {
 public:
  explicit Downloads(Store& store) : store_(store), files_(store), reports_(store) {}

  void get_mesh(Call& call);
  void get_labels(Call& call);
  void get_ridges(Call& call);
  void get_report(Call& call);

 private:
  Store& store_;
  ResultFiles files_;
  CheckedFiles reports_;
};

}  // namespace creased
