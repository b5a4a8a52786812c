// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace carom {

/// Starts to fetch the cache line at an address into the cache.
inline void prefetch_line(const void* address) {
  __builtin_prefetch(address);
  asm volatile("");  // without it g++ treats the function as pure and removes the calls
}

/// Starts to fetch the cache line at an address, to be written.
inline void prefetch_to_write(const void* address) {
  __builtin_prefetch(address, 1);
  asm volatile("");
}

}  // namespace carom
