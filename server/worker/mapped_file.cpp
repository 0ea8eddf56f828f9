#include "server/worker/mapped_file.h"

#include <sys/mman.h>
#include <sys/stat.h>

#include <cerrno>
#include <new>

#include "server/base/failure.h"

namespace creased {
namespace code = crease::code;

MappedFile::MappedFile(int file) {
  struct stat status {};
  if (::fstat(file, &status) != 0) throw file_failure("read", "a file of the task");
  if (!S_ISREG(status.st_mode)) throw crease::Error(code::kUploadDamaged, "a file of the job is not a file any more");
  if (status.st_size == 0) return;
  const auto size = static_cast<std::size_t>(status.st_size);
  void* mapping = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file, 0);
  if (mapping == MAP_FAILED && errno == ENOMEM) throw std::bad_alloc();
  if (mapping == MAP_FAILED) throw file_failure("map", "a file of the task");
  ::madvise(mapping, size, MADV_SEQUENTIAL);
  bytes_ = {static_cast<const char*>(mapping), size};
}

MappedFile::~MappedFile() {
  if (!bytes_.empty()) ::munmap(const_cast<char*>(bytes_.data()), bytes_.size());
}

}  // namespace creased
