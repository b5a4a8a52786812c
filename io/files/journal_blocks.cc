#include "io/files/journal_blocks.h"

#include <zlib.h>

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
  return crc32_z(0, reinterpret_cast<const unsigned char*>(journal.data() + kFrom), journal.size() - kFrom);
}

}  // namespace

void Blocks::put(std::uint64_t address, std::span<const std::byte> data) {
  const std::uint64_t end = address + data.size();
  auto first = blocks_.upper_bound(address);
  if (first != blocks_.begin() && end_of(*std::prev(first)) >= address)
    --first;
  else
    first = blocks_.emplace_hint(first, address, Bytes());
  Bytes& block = first->second;
  if (end_of(*first) < end) block.resize(static_cast<std::size_t>(end - first->first));
  std::ranges::copy(data, block.begin() + static_cast<std::ptrdiff_t>(address - first->first));
  for (auto next = std::next(first); next != blocks_.end() && next->first <= end; next = blocks_.erase(next))
    if (end_of(*next) > end)
      block.insert(block.end(), next->second.end() - static_cast<std::ptrdiff_t>(end_of(*next) - end),
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

Bytes Blocks::journal(std::uint64_t file_size) const {
  Head head{};
  std::memcpy(head.magic, kMagic, sizeof head.magic);
  head.length = sizeof head;
  for (const auto& [address, data] : blocks_) head.length += sizeof(BlockHead) + data.size();
  head.file_size = file_size;
  Bytes journal;
  journal.reserve(head.length);
  carom::put(journal, head);
  for (const auto& [address, data] : blocks_) {
    carom::put(journal, BlockHead{address, data.size()});
    journal.insert(journal.end(), data.begin(), data.end());
  }
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
  if (checksum(bytes) != head.checksum) return {};
  return head.file_size;
}

}  // namespace carom::hdf5
