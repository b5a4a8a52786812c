// SPDX-License-Identifier: BSD-3-Clause
// Kills the process at its KILL_AT-th change of a file whose path contains KILL_IN: a write (of which half is done where
// KILL_HALF=1), a new size, a new name, a removal, a sync. Without KILL_AT the number of changes goes to KILL_COUNT, a file.
// With KILL_ROWS only changes after this number of changes of thermo.csv count. With KILL_SIGNAL the process sends itself this
// signal there instead of SIGKILL, then makes the change. So the place of a kill or a signal does not depend on the clock.
// With STOP_ASLEEP the process stops itself (SIGSTOP) when it sleeps for the first time.
// Where KILL_LOG names a file, each change is noted there, with its path, size and place; also fdatasync, which is not
// counted: the clock decides how often the journal calls it.
//   cc -shared -fPIC -o kill_at_write.so kill_at_write.c
//   LD_PRELOAD=./kill_at_write.so KILL_IN=runs/k KILL_AT=2584 carom run … -o runs/k
#define _GNU_SOURCE
#include <dlfcn.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>
#include <time.h>
#include <unistd.h>

static long changes = 0, rows = 0;

static void note(const char* what, const char* path, long long size, long long at) {
  const char* name = getenv("KILL_LOG");
  FILE* out = name != NULL ? fopen(name, "a") : NULL;
  if (out == NULL) return;
  fprintf(out, "%s %s %lld %lld\n", what, path, size, at);
  fclose(out);
}

__attribute__((destructor)) static void report(void) {
  const char* name = getenv("KILL_COUNT");
  FILE* out = name != NULL ? fopen(name, "w") : NULL;
  if (out == NULL) return;
  fprintf(out, "%ld\n", changes);
  fclose(out);
}

static int concerned(const char* path) {
  const char* in = getenv("KILL_IN");
  return in != NULL && strstr(path, in) != NULL;
}

/// Whether this is the change to die at.
static int due(const char* what, const char* path, long long size, long long at) {
  const char* when = getenv("KILL_AT");
  const char* number = getenv("KILL_SIGNAL");
  const char* after = getenv("KILL_ROWS");
  if (strstr(path, "/thermo.csv") != NULL) ++rows;
  if (!concerned(path)) return 0;
  note(what, path, size, at);
  if (after != NULL && rows < atol(after)) return 0;
  ++changes;
  if (when == NULL || changes != atol(when)) return 0;
  if (number == NULL) return 1;
  kill(getpid(), atoi(number));
  return 0;
}

/// The path of an open file; NULL: it has none.
static const char* path_of(int descriptor) {
  static char path[4096];
  char link[64];
  snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
  const ssize_t n = readlink(link, path, sizeof path - 1);
  if (n < 0) return NULL;
  path[n] = 0;
  return path;
}

static int due_at(const char* what, int descriptor, long long size, long long at) {
  const char* path = path_of(descriptor);
  return path != NULL && due(what, path, size, at);
}

static void die(void) {
  kill(getpid(), SIGKILL);
  for (;;) pause();
}

static size_t half(size_t size) {
  const char* wanted = getenv("KILL_HALF");
  return wanted != NULL && *wanted == '1' ? size / 2 : 0;
}

#define REAL(type, name, ...)               \
  static type (*real)(__VA_ARGS__) = NULL;  \
  if (real == NULL) *(void**)&real = dlsym(RTLD_NEXT, #name)

#define PWRITE(name, offset)                                           \
  ssize_t name(int file, const void* data, size_t size, offset at) {   \
    REAL(ssize_t, name, int, const void*, size_t, offset);             \
    if (!due_at("write", file, (long long)size, at)) return real(file, data, size, at); \
    if (half(size) > 0) real(file, data, half(size), at);              \
    die();                                                             \
    return -1;                                                         \
  }
PWRITE(pwrite, off_t)
PWRITE(pwrite64, off64_t)

ssize_t write(int file, const void* data, size_t size) {
  REAL(ssize_t, write, int, const void*, size_t);
  if (!due_at("write", file, (long long)size, -1)) return real(file, data, size);
  if (half(size) > 0) real(file, data, half(size));
  die();
  return -1;
}

#define RESIZE(name, offset)             \
  int name(int file, offset size) {      \
    REAL(int, name, int, offset);        \
    if (due_at("resize", file, size, 0)) die(); \
    return real(file, size);             \
  }
RESIZE(ftruncate, off_t)
RESIZE(ftruncate64, off64_t)

int fsync(int file) {
  REAL(int, fsync, int);
  if (due_at("sync", file, 0, 0)) die();
  return real(file);
}

int fdatasync(int file) {
  REAL(int, fdatasync, int);
  const char* path = path_of(file);
  if (path == NULL || !concerned(path) || getenv("KILL_LOG") == NULL) return real(file);
  note("sync", path, 0, 0);
  return 0;  // which takes no time: so the journal syncs often
}

int nanosleep(const struct timespec* time, struct timespec* rest) {
  static int stopped = 0;
  REAL(int, nanosleep, const struct timespec*, struct timespec*);
  if (getenv("STOP_ASLEEP") != NULL && !stopped) {
    stopped = 1;
    kill(getpid(), SIGSTOP);
  }
  return real(time, rest);
}

#define SET_ASIDE(name, offset)                                  \
  int name(int file, int mode, offset start, offset length) {    \
    REAL(int, name, int, int, offset, offset);                   \
    if (due_at("room", file, length, start)) die();              \
    return real(file, mode, start, length);                      \
  }
SET_ASIDE(fallocate, off_t)
SET_ASIDE(fallocate64, off64_t)

int rename(const char* from, const char* to) {
  REAL(int, rename, const char*, const char*);
  if (due("rename", to, 0, 0)) die();
  return real(from, to);
}

int unlink(const char* path) {
  REAL(int, unlink, const char*);
  if (due("remove", path, 0, 0)) die();
  return real(path);
}

int remove(const char* path) {
  REAL(int, remove, const char*);
  if (due("remove", path, 0, 0)) die();
  return real(path);
}
