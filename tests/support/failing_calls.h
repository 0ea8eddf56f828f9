#ifndef FAILING_CALLS_H
#define FAILING_CALLS_H

/* What a test and the processes that it makes fail share: a file that all of them map. */

#include <stdint.h>

enum FailingKind {
  kFailIo = 0,          /* EIO */
  kFailNoSpace = 1,     /* ENOSPC; reads: EIO */
  kFailShort = 2,       /* half of a read or write */
  kFailInterrupted = 3, /* EINTR */
  kFailKinds = 4
};

struct FailingCalls {
  uint64_t count;   /* calls on files of the data folder so far, of all processes */
  uint64_t fire_at; /* the call that fails; 0 for none */
  uint32_t kind;
  uint32_t fired; /* 1 when it has failed */
  char what[64];  /* its name and the end of its path */
};

/* CREASED_FAILING_CALLS names the file, CREASED_FAILING_FOLDER the folder whose files count. */

#endif
