// SPDX-License-Identifier: BSD-3-Clause
#include "io/files/rank_account.h"

#include <sys/resource.h>

#include <algorithm>
#include <cstring>
#include <type_traits>

namespace carom {

std::vector<RankAccount> accounts_of_all(Communicator& at_work, const Statistics& mine) {
  static_assert(std::is_trivially_copyable_v<RankAccount>);
  const RankAccount account{mine.counters.seconds, mine.counters.windows, mine.wall_seconds, peak_memory_bytes()};
  Bytes bytes(sizeof account);
  std::memcpy(bytes.data(), &account, sizeof account);
  std::vector<RankAccount> all;
  for (const Bytes& theirs : at_work.gather(bytes)) std::memcpy(&all.emplace_back(), theirs.data(), sizeof account);
  return all;
}

std::uint64_t peak_memory_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

std::uint64_t peak_memory_bytes(std::span<const RankAccount> accounts) {
  std::uint64_t largest = 0;
  for (const RankAccount& account : accounts) largest = std::max(largest, account.peak_memory_bytes);
  return largest;
}

}  // namespace carom
