// SPDX-License-Identifier: BSD-3-Clause
#include "io/files/journal_blocks.h"

#include <libdeflate.h>

#include <algorithm>
#include <bit>
#include <iterator>

namespace carom::hdf5 {

namespace {

static_assert(std::endian::native == std::endian::little);

struct Head {
  char magic[8];
  std::uint64_t checksum, length, file_size;
};
static_assert(sizeof(Head) == kJournalHead);
constexpr char kMagic[] = "CAROMJ01";

std::uint64_t checksum(const Bytes& journal) {
  constexpr std::size_t kFrom = offsetof(Head, length);
  return libdeflate_crc32(0, journal.data() + kFrom, journal.size() - kFrom);
}

/// Whether the last block ends where the journal does.
bool blocks_fit(const Bytes& journal) {
  std::size_t at = kJournalHead;
  while (journal.size() - at >= sizeof(BlockHead)) {
    BlockHead block;
    std::memcpy(&block, journal.data() + at, sizeof block);
    at += sizeof block;
    if (block.length > journal.size() - at) return false;
    at += block.length;
  }
  return at == journal.size();
}

/// Calls take(first, last) for the ranges in which `data` differs from an equally long array, in steps of a cache line.
template <class Take>
void for_each_difference(std::span<const std::byte> data, std::span<const std::byte> others, Take take) {
  constexpr std::size_t kCompareStep = 64;
  const auto same = [&](std::size_t at) {
    return std::memcmp(&data[at], &others[at], std::min(kCompareStep, data.size() - at)) == 0;
  };
  for (std::size_t at = 0; at < data.size(); at += kCompareStep) {
    if (same(at)) continue;
    const std::size_t first = at;
    while (at < data.size() && !same(at)) at += kCompareStep;
    take(first, std::min(at, data.size()));
  }
}

}  // namespace

void Blocks::put(std::uint64_t address, std::span<const std::byte> data) {
  const std::uint64_t end = address + data.size();
  auto first = blocks_.upper_bound(address);
  if (first != blocks_.begin() && end_of(*std::prev(first)) >= address) {
    --first;
    const std::size_t from = address - first->first, over = std::min(data.size(), first->second.size() - from);
    std::memcpy(first->second.data() + from, data.data(), over);
    first->second.insert(first->second.end(), data.begin() + static_cast<std::ptrdiff_t>(over), data.end());
  } else {
    first = blocks_.emplace_hint(first, address, Bytes(data.begin(), data.end()));
  }
  for (auto next = std::next(first); next != blocks_.end() && next->first <= end; next = blocks_.erase(next))
    if (end_of(*next) > end)
      first->second.insert(first->second.end(), next->second.end() - static_cast<std::ptrdiff_t>(end_of(*next) - end),
                           next->second.end());
}

void Blocks::overlay(std::uint64_t address, std::span<std::byte> data) const {
  const std::uint64_t end = address + data.size();
  auto block = blocks_.upper_bound(address);
  if (block != blocks_.begin()) --block;
  for (; block != blocks_.end() && block->first < end; ++block) {
    const std::uint64_t from = std::max(block->first, address), to = std::min(end_of(*block), end);
    if (from < to)
      std::memcpy(data.data() + (from - address), block->second.data() + (from - block->first),
                  static_cast<std::size_t>(to - from));
  }
}

Bytes Blocks::journal(std::uint64_t file_size, const Blocks& there) const {
  Head head{};
  std::memcpy(head.magic, kMagic, sizeof head.magic);
  head.file_size = file_size;
  Bytes journal;
  carom::put(journal, head);
  for (const auto& [address, data] : blocks_) {
    const auto add = [&journal, at = address, &data = data](std::size_t first, std::size_t last) {
      carom::put(journal, BlockHead{at + first, last - first});
      journal.insert(journal.end(), data.begin() + static_cast<std::ptrdiff_t>(first),
                     data.begin() + static_cast<std::ptrdiff_t>(last));
    };
    const auto old = there.blocks_.find(address);
    if (old != there.blocks_.end() && old->second.size() == data.size())
      for_each_difference(data, old->second, add);
    else
      add(0, data.size());
  }
  head.length = journal.size();
  std::memcpy(journal.data(), &head, sizeof head);
  head.checksum = checksum(journal);
  std::memcpy(journal.data(), &head, sizeof head);
  return journal;
}

std::optional<std::uint64_t> complete_journal(Bytes& bytes) {
  Head head{};
  if (bytes.size() < sizeof head) return {};
  std::memcpy(&head, bytes.data(), sizeof head);
  if (std::memcmp(head.magic, kMagic, sizeof head.magic) != 0 || head.length < sizeof head ||
      head.length > bytes.size())
    return {};
  bytes.resize(head.length);
  if (checksum(bytes) != head.checksum || !blocks_fit(bytes)) return {};
  return head.file_size;
}

}  // namespace carom::hdf5
