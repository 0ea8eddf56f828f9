#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <unordered_set>
#include <vector>

namespace creased {

/// The files of a data directory: jobs/ID/ for each job, and incoming/ for uploads that are being received and jobs
/// that are being removed. Every function may throw Error store_unavailable with the message of the operating system.
class JobFiles {
 public:
  /// Creates missing folders, which only the service's user can read.
  explicit JobFiles(const std::filesystem::path& data_dir);

  /// Whether `id` has the form of a job id: 1 to 64 hexadecimal digits and hyphens. No other text becomes part of a
  /// path.
  static bool valid_id(std::string_view id);

  /// \throw Error job_not_found for an invalid id, or a name with other characters than lower-case letters, hyphens,
  /// and dots inside
  std::filesystem::path path(std::string_view id, std::string_view name) const;
  std::filesystem::path temporary_path() const;

  /// Reserves `id` by creating its folder. Returns false when it is taken.
  bool reserve(std::string_view id) const;
  /// Moves a file into a reserved folder under `name`. The file is on the disk when the call returns.
  void adopt(std::string_view id, const std::filesystem::path& source, std::string_view name) const;
  /// Removes the files that only a running job needs, including incomplete files.
  void remove_working_files(std::string_view id) const;
  /// Total size of the files of a job; 0 when it has none.
  std::int64_t bytes(std::string_view id) const;
  /// Free space on the disk for this service, and the total size of the disk.
  struct Room {
    std::uint64_t free = 0, total = 0;
    /// Space to leave free for the database and for other programs.
    std::uint64_t reserve() const;
  };
  Room room() const;
  /// Removes the folder of a job, durably. First moves it away, so that a process that still writes there cannot keep
  /// it.
  void discard(std::string_view id) const;
  /// Writes, syncs and removes a small file.
  void probe() const;
  /// Removes what killed processes have left behind, once it is older than `age`.
  void clean_leftovers(const std::unordered_set<std::string>& known_ids, std::chrono::seconds age) const;
  /// The ids of all folders of jobs.
  std::vector<std::string> ids() const;
  /// Frees the space that is kept for the database on a full disk. Returns false when there is none.
  bool free_ballast() const;
  /// Takes that space again when there is room.
  void take_ballast() const;

 private:
  std::filesystem::path folder(std::string_view id) const;

  std::filesystem::path jobs_, incoming_, ballast_;
};

}  // namespace creased
