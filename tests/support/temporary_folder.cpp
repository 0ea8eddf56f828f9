#include "tests/support/temporary_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mount.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace crease::test {
namespace fs = std::filesystem;
namespace {

/// A lock on a file. It lasts until the destructor, or until the process and all that it forked have ended.
class Lock {
 public:
  Lock(const fs::path& file, int operation) : file_(::open(file.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0600)) {
    held_ = file_ >= 0 && ::flock(file_, operation) == 0;
  }
  ~Lock() {
    if (file_ >= 0) ::close(file_);
  }
  Lock(const Lock&) = delete;
  Lock& operator=(const Lock&) = delete;
  bool held() const { return held_; }

 private:
  int file_;
  bool held_ = false;
};

/// Unmounts the disks that a test has mounted in the folder.
void unmount_below(const fs::path& folder) {
  std::vector<std::string> below;
  std::ifstream mounts("/proc/self/mounts");
  for (std::string line; std::getline(mounts, line);) {
    std::string device, path;
    std::istringstream(line) >> device >> path;
    if (path.starts_with(folder.string() + "/")) below.push_back(path);
  }
  for (const auto& path : below) ::umount2(path.c_str(), MNT_DETACH);
}

void remove_quietly(const fs::path& folder) {
  std::error_code ignored;
  fs::remove_all(folder, ignored);
}

fs::path new_folder(const fs::path& parent, const std::string& prefix = "") {
  std::string name = (parent / (prefix + "XXXXXX")).string();
  if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("cannot make a folder in " + parent.string());
  return name;
}

constexpr const char* kLockName = "lock";

/// Removes the folders of processes that ended without doing so.
void remove_abandoned(const fs::path& root) {
  for (const auto& entry : fs::directory_iterator(root)) {
    if (!entry.is_directory() || !Lock(entry.path() / kLockName, LOCK_EX | LOCK_NB).held()) continue;
    unmount_below(entry.path());
    remove_quietly(entry.path());
  }
}

/// The folder of this process in the folder of all tests. A lock marks it as in use.
class FolderOfProcess {
 public:
  FolderOfProcess() {
    const fs::path root = fs::temp_directory_path() / ("creased-tests-" + std::to_string(::getuid()));
    fs::create_directories(root);
    const Lock alone(root / kLockName, LOCK_EX);
    remove_abandoned(root);
    path_ = new_folder(root);
    lock_ = std::make_unique<Lock>(path_ / kLockName, LOCK_EX);
  }
  ~FolderOfProcess() {
    if (process_ == ::getpid()) remove_quietly(path_);
  }
  FolderOfProcess(const FolderOfProcess&) = delete;
  FolderOfProcess& operator=(const FolderOfProcess&) = delete;
  const fs::path& path() const { return path_; }

 private:
  const pid_t process_ = ::getpid();
  fs::path path_;
  std::unique_ptr<Lock> lock_;
};

}  // namespace

TemporaryFolder::TemporaryFolder() {
  static const FolderOfProcess of_process;
  path_ = new_folder(of_process.path());
}

TemporaryFolder::~TemporaryFolder() { remove_quietly(path_); }

// Not in the folder of the process: only its user may enter that.
PublicFolder::PublicFolder() : path_(new_folder(fs::temp_directory_path(), "creased-public-")) {
  fs::permissions(path_, fs::perms::all);
}

PublicFolder::~PublicFolder() { remove_quietly(path_); }

}  // namespace crease::test
