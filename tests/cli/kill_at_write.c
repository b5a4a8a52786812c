// Kills the process at its KILL_AT-th change of a file whose path contains KILL_IN: a write (of which half is done where
// KILL_HALF=1), a new size, a new name, a removal, a sync. Without KILL_AT the number of changes goes to KILL_COUNT, a file.
//   cc -shared -fPIC -o kill_at_write.so kill_at_write.c
//   LD_PRELOAD=./kill_at_write.so KILL_IN=runs/k KILL_AT=2584 carom run … -o runs/k
#define _GNU_SOURCE
#include <dlfcn.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>
#include <unistd.h>

static long changes = 0;

__attribute__((destructor)) static void report(void) {
  const char* name = getenv("KILL_COUNT");
  FILE* out = name != NULL ? fopen(name, "w") : NULL;
  if (out == NULL) return;
  fprintf(out, "%ld\n", changes);
  fclose(out);
}

/// Whether this is the change to die at.
static int due(const char* path) {
  const char *in = getenv("KILL_IN"), *at = getenv("KILL_AT");
  if (in == NULL || strstr(path, in) == NULL) return 0;
  ++changes;
  return at != NULL && changes == atol(at);
}

static int due_at(int descriptor) {
  char link[64], path[4096];
  snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
  const ssize_t n = readlink(link, path, sizeof path - 1);
  if (n < 0) return 0;
  path[n] = 0;
  return due(path);
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
    if (!due_at(file)) return real(file, data, size, at);              \
    if (half(size) > 0) real(file, data, half(size), at);              \
    die();                                                             \
    return -1;                                                         \
  }
PWRITE(pwrite, off_t)
PWRITE(pwrite64, off64_t)

ssize_t write(int file, const void* data, size_t size) {
  REAL(ssize_t, write, int, const void*, size_t);
  if (!due_at(file)) return real(file, data, size);
  if (half(size) > 0) real(file, data, half(size));
  die();
  return -1;
}

#define RESIZE(name, offset)             \
  int name(int file, offset size) {      \
    REAL(int, name, int, offset);        \
    if (due_at(file)) die();             \
    return real(file, size);             \
  }
RESIZE(ftruncate, off_t)
RESIZE(ftruncate64, off64_t)

int fsync(int file) {
  REAL(int, fsync, int);
  if (due_at(file)) die();
  return real(file);
}

#define SET_ASIDE(name, offset)                                  \
  int name(int file, int mode, offset start, offset length) {    \
    REAL(int, name, int, int, offset, offset);                   \
    if (due_at(file)) die();                                     \
    return real(file, mode, start, length);                      \
  }
SET_ASIDE(fallocate, off_t)
SET_ASIDE(fallocate64, off64_t)

int rename(const char* from, const char* to) {
  REAL(int, rename, const char*, const char*);
  if (due(to)) die();
  return real(from, to);
}

int unlink(const char* path) {
  REAL(int, unlink, const char*);
  if (due(path)) die();
  return real(path);
}

int remove(const char* path) {
  REAL(int, remove, const char*);
  if (due(path)) die();
  return real(path);
}
