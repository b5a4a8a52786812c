// SPDX-License-Identifier: BSD-3-Clause
// The replay of a journal from a fuzzer, unchanged and with a valid length and CRC-32: the file is changed only if the
// journal is complete.

#include <fcntl.h>
#include <libdeflate.h>

#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "io/files/journal.h"
#include "io/files/journal_blocks.h"
#include "tests/fuzz/memory_file.h"

namespace {

using namespace carom;

/// A directory in memory that is removed when the process ends.
struct Directory {
  std::filesystem::path path;
  Directory() {
    char name[] = "/dev/shm/carom-fuzz.XXXXXX";
    if (::mkdtemp(name) == nullptr) std::abort();
    path = name;
  }
  ~Directory() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
};

void write(const std::filesystem::path& path, const std::vector<std::uint8_t>& bytes) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  if (file < 0 || ::write(file, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size())) std::abort();
  ::close(file);
}

bool has(const std::filesystem::path& path, const std::vector<std::uint8_t>& bytes) {
  std::ifstream in(path, std::ios::binary);
  return std::filesystem::file_size(path) == bytes.size() &&
         std::equal(bytes.begin(), bytes.end(), std::istreambuf_iterator<char>(in), {},
                    [](std::uint8_t a, char b) { return static_cast<char>(a) == b; });
}

void replay(const std::vector<std::uint8_t>& journal) {
  static const Directory directory;
  static const std::vector<std::uint8_t> contents(1000, 7);
  const auto file = directory.path / "a.h5", beside = directory.path / "a.h5.journal";
  write(file, contents);
  write(beside, journal);
  try {
    hdf5::replay_journal(file);
    if (std::filesystem::exists(beside)) std::abort();
  } catch (const Error& e) {
    if (e.failure() != Failure::file) std::abort();
  }
  const auto bytes = std::as_bytes(std::span(journal));
  Bytes copy(bytes.begin(), bytes.end());
  if (!hdf5::complete_journal(copy)) {
    if (!has(file, contents)) std::abort();
    return;
  }
  hdf5::for_each_block(copy, [&](std::uint64_t, const std::byte* data, std::uint64_t length) {
    if (data > copy.data() + copy.size() || length > static_cast<std::uint64_t>(copy.data() + copy.size() - data))
      std::abort();
    return true;
  });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::vector<std::uint8_t> journal(data, data + size);
  replay(journal);
  if (size < hdf5::kJournalHead) return 0;
  const std::uint64_t length = size;
  std::memcpy(journal.data(), "CAROMJ01", 8);
  std::memcpy(journal.data() + 16, &length, sizeof length);
  const std::uint64_t checksum = libdeflate_crc32(0, journal.data() + 16, size - 16);
  std::memcpy(journal.data() + 8, &checksum, sizeof checksum);
  replay(journal);
  return 0;
}
