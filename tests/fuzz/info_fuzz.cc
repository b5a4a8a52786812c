// SPDX-License-Identifier: BSD-3-Clause
// `carom info` on the bytes of a trajectory or a file of events: it prints a text or throws an Error.

#include "engine/base/error.h"
#include "io/files/info.h"
#include "tests/fuzz/memory_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const carom::fuzz::MemoryFile file;
  file.set({data, size});
  try {
    carom::describe_file(file.path());
  } catch (const carom::Error& e) {
    if (e.failure() != carom::Failure::file) std::abort();
  }
  return 0;
}
