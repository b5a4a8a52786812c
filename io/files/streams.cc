// SPDX-License-Identifier: BSD-3-Clause
// What HDF5 uses as stdout and stderr in a portable build (cmake/portable.cmake).
#include <cstdio>

extern "C" {
FILE* carom_stdout = stdout;
FILE* carom_stderr = stderr;
}
