/* A library to preload: it makes the n-th open, read, write, fsync or rename on a file of one folder fail. */

#define _GNU_SOURCE
#include "tests/support/failing_calls.h"

#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

enum { kMostFiles = 4096 };

static struct FailingCalls *calls;
static const char *folder;
static atomic_bool watched[kMostFiles]; /* descriptors of files of the folder */

/* The next function of this name, as a pointer of the right type. */
#define NEXT(function, name) \
  static __typeof__(&function) name; \
  if (name == NULL) *(void **)&name = dlsym(RTLD_NEXT, #function)

__attribute__((constructor)) static void begin(void) {
  const char *path = getenv("CREASED_FAILING_CALLS");
  folder = getenv("CREASED_FAILING_FOLDER");
  NEXT(open, real_open);
  const int file = path == NULL || folder == NULL ? -1 : real_open(path, O_RDWR | O_CLOEXEC);
  if (file < 0) return;
  void *shared = mmap(NULL, sizeof *calls, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  close(file);
  if (shared != MAP_FAILED) calls = shared;
}

static int is_watched(int file) {
  return calls != NULL && file >= 0 && file < kMostFiles && atomic_load_explicit(&watched[file], memory_order_relaxed);
}

static int is_in_folder(const char *path) {
  return calls != NULL && path != NULL && strncmp(path, folder, strlen(folder)) == 0;
}

/* The kind of fault of this call, or -1 when it is to do its work. */
static int fault_of(const char *name, const char *path) {
  const uint64_t number = __atomic_add_fetch(&calls->count, 1, __ATOMIC_SEQ_CST);
  if (number != __atomic_load_n(&calls->fire_at, __ATOMIC_SEQ_CST)) return -1;
  const size_t length = strlen(path), most = 40;
  snprintf(calls->what, sizeof calls->what, "%s %s", name, path + (length > most ? length - most : 0));
  __atomic_store_n(&calls->fired, 1, __ATOMIC_SEQ_CST);
  return (int)calls->kind;
}

static int fault_of_file(const char *name, int file) {
  char link[64], path[512];
  if (!is_watched(file)) return -1;
  snprintf(link, sizeof link, "/proc/self/fd/%d", file);
  const ssize_t length = readlink(link, path, sizeof path - 1);
  path[length < 0 ? 0 : length] = '\0';
  return fault_of(name, path);
}

static int fail(int number) {
  errno = number;
  return -1;
}

static int fail_as(int kind, int writes) {
  if (kind == kFailInterrupted) return fail(EINTR);
  return fail(kind == kFailNoSpace && writes ? ENOSPC : EIO);
}

static int note(int file, const char *path) {
  if (file >= 0 && file < kMostFiles) atomic_store(&watched[file], is_in_folder(path));
  return file;
}

#define OPEN(function)                                                                          \
  int function(const char *path, int flags, ...) {                                              \
    NEXT(function, real);                                                                       \
    mode_t mode = 0;                                                                            \
    if ((flags & (O_CREAT | __O_TMPFILE)) != 0) {                                               \
      va_list more;                                                                             \
      va_start(more, flags);                                                                    \
      mode = va_arg(more, mode_t);                                                              \
      va_end(more);                                                                             \
    }                                                                                           \
    const int kind = is_in_folder(path) ? fault_of("open", path) : -1;                          \
    if (kind >= 0 && kind != kFailShort) return fail_as(kind, (flags & O_CREAT) != 0);          \
    return note(real(path, flags, mode), path);                                                 \
  }
OPEN(open)
OPEN(open64)

#define TRANSFER(function, writes, parameters, whole, half)            \
  ssize_t function parameters {                                        \
    NEXT(function, real);                                              \
    const int kind = fault_of_file(#function, file);                   \
    if (kind == kFailShort && size > 1) return real half;              \
    return kind >= 0 && kind != kFailShort ? fail_as(kind, writes) : real whole; \
  }
TRANSFER(read, 0, (int file, void *data, size_t size), (file, data, size), (file, data, size / 2))
TRANSFER(write, 1, (int file, const void *data, size_t size), (file, data, size), (file, data, size / 2))
TRANSFER(pread, 0, (int file, void *data, size_t size, off_t at), (file, data, size, at), (file, data, size / 2, at))
TRANSFER(pread64, 0, (int file, void *data, size_t size, off64_t at), (file, data, size, at),
         (file, data, size / 2, at))
TRANSFER(pwrite, 1, (int file, const void *data, size_t size, off_t at), (file, data, size, at),
         (file, data, size / 2, at))
TRANSFER(pwrite64, 1, (int file, const void *data, size_t size, off64_t at), (file, data, size, at),
         (file, data, size / 2, at))

#define SYNC(function)                                                              \
  int function(int file) {                                                          \
    NEXT(function, real);                                                           \
    const int kind = fault_of_file(#function, file);                                \
    return kind >= 0 && kind != kFailShort ? fail_as(kind, 1) : real(file);         \
  }
SYNC(fsync)
SYNC(fdatasync)

int rename(const char *from, const char *to) {
  NEXT(rename, real);
  const int kind = is_in_folder(to) ? fault_of("rename", to) : -1;
  return kind == kFailIo || kind == kFailNoSpace ? fail_as(kind, 1) : real(from, to);
}

int close(int file) {
  NEXT(close, real);
  if (file >= 0 && file < kMostFiles) atomic_store(&watched[file], 0);
  return real(file);
}
