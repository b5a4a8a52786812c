// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Memory that will be wanted soon.

namespace carom {

/// Starts to fetch the cache line at an address into the cache.
inline void prefetch_line(const void* address) {
  __builtin_prefetch(address);
  asm volatile("");  // or g++ takes a function that does nothing else for one without any effect, and never calls it
}

}  // namespace carom
