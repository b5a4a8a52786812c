// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Blocks of a file that wait to be written, and their form in a journal (the format is in journal.h).

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <span>

#include "engine/ranks/communicator.h"

namespace carom::hdf5 {

/// Blocks that do not overlap, by their addresses.
class Blocks {
 public:
  /// Adds a block, which replaces earlier data at these addresses; adjacent blocks are merged.
  void put(std::uint64_t address, std::span<const std::byte> data);
  /// Copies the stored bytes in [address, address + its size) over `data`.
  void overlay(std::uint64_t address, std::span<std::byte> data) const;
  /// All blocks as a journal of a file that then has `file_size` bytes. Bytes equal to the blocks `there`, which are in
  /// the file already, are left out: HDF5 writes a whole chunk for each new row.
  Bytes journal(std::uint64_t file_size, const Blocks& there) const;
  bool empty() const { return blocks_.empty(); }

 private:
  using Block = std::pair<const std::uint64_t, Bytes>;
  static std::uint64_t end_of(const Block& block) { return block.first + block.second.size(); }
  std::map<std::uint64_t, Bytes> blocks_;
};

/// The size of the file, if `bytes` begin with a complete journal; the bytes after it are removed.
std::optional<std::uint64_t> complete_journal(Bytes& bytes);

/// The header of each block of a journal.
struct BlockHead {
  std::uint64_t address, length;
};
constexpr std::size_t kJournalHead = 32;  // bytes

/// write(address, data, length) for each block of a complete journal, while it returns true; whether all were written.
template <class Write>
bool for_each_block(const Bytes& journal, Write write) {
  for (std::size_t at = kJournalHead; at < journal.size();) {
    BlockHead block;
    std::memcpy(&block, journal.data() + at, sizeof block);
    at += sizeof block;
    if (!write(block.address, journal.data() + at, block.length)) return false;
    at += block.length;
  }
  return true;
}

}  // namespace carom::hdf5
