#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <unordered_set>

namespace creased {

/// The files of a data directory: jobs/ID/… of the jobs, incoming/ for uploads on their way in and jobs on their way
/// out. Every function may throw Error store_unavailable with the reason of the operating system.
class JobFiles {
 public:
  /// Creates the folders that are missing, readable by nobody else.
  explicit JobFiles(const std::filesystem::path& data_dir);

  /// Whether `id` can be the id of a job: 1 to 64 hexadecimal digits and hyphens. No other text becomes part of a path.
  static bool valid_id(std::string_view id);

  /// \throw Error job_not_found for an id that is none, or a name with anything but lower-case letters, dots inside
  /// and hyphens
  std::filesystem::path path(std::string_view id, std::string_view name) const;
  std::filesystem::path temporary_path() const;

  /// Takes `id` by creating its folder; false when it is taken.
  bool reserve(std::string_view id) const;
  /// Moves a file into a reserved folder under `name`; on the disk when it returns.
  void adopt(std::string_view id, const std::filesystem::path& source, std::string_view name) const;
  /// Removes what only a running job needs, half-written files included.
  void remove_working_files(std::string_view id) const;
  /// Of the files of a job; 0 where there are none.
  std::int64_t bytes(std::string_view id) const;
  /// What the disk has left for this service, and all that it holds.
  struct Room {
    std::uint64_t free = 0, total = 0;
  };
  Room room() const;
  /// Removes the folder of a job. It is out of sight at once, so that nobody who still writes there can keep it.
  void discard(std::string_view id) const;
  /// Writes, syncs and removes a small file.
  void probe() const;
  /// Removes what killed processes have left behind, once it is older than `age`.
  void clean_leftovers(const std::unordered_set<std::string>& known_ids, std::chrono::seconds age) const;

 private:
  std::filesystem::path folder(std::string_view id) const;

  std::filesystem::path jobs_, incoming_;
};

}  // namespace creased
