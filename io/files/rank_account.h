// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What each rank sends to rank 0 at the end of a run: the times of its parts, and its memory.

#include <cstdint>
#include <span>
#include <vector>

#include "engine/ranks/communicator.h"
#include "engine/run/simulation.h"

namespace carom {

struct RankAccount {
  Counters::Seconds seconds;
  WindowCounts windows;
  double wall_seconds = 0;
  std::uint64_t peak_memory_bytes = 0;
};

/// Collective: the accounts of all ranks in use, by rank.
std::vector<RankAccount> accounts_of_all(Communicator& at_work, const Statistics& mine);

/// Largest resident memory of this process so far [bytes].
std::uint64_t peak_memory_bytes();
/// The largest value of all accounts.
std::uint64_t peak_memory_bytes(std::span<const RankAccount> accounts);

}  // namespace carom
