// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Bytes as a file in memory, for readers that want a path.

#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <span>
#include <string>

namespace carom::fuzz {

class MemoryFile {
 public:
  MemoryFile() : file_(::memfd_create("carom-fuzz", MFD_CLOEXEC)) {
    if (file_ < 0) std::abort();
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { ::close(file_); }

  std::filesystem::path path() const { return "/proc/self/fd/" + std::to_string(file_); }
  void set(std::span<const std::uint8_t> bytes) const {
    if (::ftruncate(file_, 0) != 0 ||
        ::pwrite(file_, bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
      std::abort();
  }

 private:
  int file_;
};

}  // namespace carom::fuzz
