// SPDX-License-Identifier: BSD-3-Clause
// The reader of checkpoints on bytes from a fuzzer, unchanged and with a valid length and CRC-32: a run continues,
// `carom info` succeeds, or there is an Error.

#include <libdeflate.h>

#include <algorithm>
#include <cstdio>
#include <vector>

#include "engine/base/error.h"
#include "engine/run/mean_squared_displacement.h"
#include "engine/run/state.h"
#include "io/files/checkpoint.h"
#include "io/files/info.h"
#include "tests/fuzz/memory_file.h"

namespace {

using namespace carom;

constexpr std::size_t kBlock = 512;

/// Restores three discs with an average from the file, like `carom run --continue`.
void restore_from(const std::filesystem::path& path) {
  const Checkpoint checkpoint(path);
  System<2> system;
  system.box.edges = {12, 6};
  for (int i = 0; i < 3; ++i) system.particles.add({.x = {2.0 + 2 * i, 3}, .v = {0, 0}, .radius = 0.5, .mass = 1.0});
  std::vector<Vec<2>> acceleration(3);
  system.fields.add("acceleration", acceleration);
  MeanSquaredDisplacement<2> average(system, Sampling{.interval = 1});
  average.add_state(system.fields, "msd");
  restore_state(system, [&](const std::string& name) { return checkpoint.read(name); });
}

void expect_an_error_at_most(const std::filesystem::path& path, void (*read)(const std::filesystem::path&)) {
  try {
    read(path);
  } catch (const Error& e) {
    if (e.failure() != Failure::file) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const fuzz::MemoryFile file;
  std::vector<std::uint8_t> bytes(data, data + size);
  for (const bool sign : {false, true}) {
    if (sign) {
      bytes.resize(std::max(size, kBlock));
      std::fill_n(bytes.begin(), kBlock, std::uint8_t{0});
      const std::size_t rest = bytes.size() - kBlock;
      std::snprintf(reinterpret_cast<char*>(bytes.data()), kBlock, "carom checkpoint 8\nbytes %zu\ncrc32 %08x\n", rest,
                    libdeflate_crc32(0, bytes.data() + kBlock, rest));
    }
    file.set(bytes);
    expect_an_error_at_most(file.path(), [](const std::filesystem::path& path) { describe_file(path); });
    if (sign) expect_an_error_at_most(file.path(), restore_from);
  }
  return 0;
}
