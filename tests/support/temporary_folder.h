#pragma once

#include <filesystem>

namespace crease::test {

/// A temporary folder. The destructor removes it. All of them are in creased-tests-<user> in the system's temporary
/// folder; what a killed test leaves there is removed when the next one starts.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// A temporary folder that every user can reach and write. The destructor removes it.
class PublicFolder {
 public:
  PublicFolder();
  ~PublicFolder();
  PublicFolder(const PublicFolder&) = delete;
  PublicFolder& operator=(const PublicFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace crease::test
