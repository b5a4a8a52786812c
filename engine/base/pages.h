// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Memory for large arrays with random access, in huge pages if the system grants them: with a million particles these
// avoid most TLB misses.

#include <cstdlib>
#include <new>
#include <utility>
#include <vector>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace carom {

template <class T>
struct PageAllocator {
  using value_type = T;
  PageAllocator() = default;
  template <class U>
  PageAllocator(const PageAllocator<U>&) {}  // NOLINT(google-explicit-constructor): the standard requires it

  T* allocate(std::size_t n) {
    const std::size_t bytes = n * sizeof(T), page = bytes < kHugePage ? kLine : kHugePage;
    void* const memory = std::aligned_alloc(page, (bytes + page - 1) / page * page);
    if (!memory) throw std::bad_alloc();
#if defined(__linux__)
    if (page == kHugePage) madvise(memory, bytes, MADV_HUGEPAGE);
#endif
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, std::size_t) { std::free(memory); }
  bool operator==(const PageAllocator&) const { return true; }

 private:
  static constexpr std::size_t kLine = 64, kHugePage = std::size_t{1} << 21;
};

/// A vector for large arrays of the event core; its memory starts at a cache line.
template <class T>
using PageVector = std::vector<T, PageAllocator<T>>;

/// For arrays that are written before they are read: new elements are not initialized.
template <class T>
struct RawPageAllocator : PageAllocator<T> {
  template <class U>
  struct rebind {
    using other = RawPageAllocator<U>;
  };
  RawPageAllocator() = default;
  template <class U>
  RawPageAllocator(const RawPageAllocator<U>&) {}  // NOLINT(google-explicit-constructor): the standard requires it
  void construct(T* at) { ::new (static_cast<void*>(at)) T; }
  template <class... Given>
  void construct(T* at, Given&&... given) {
    ::new (static_cast<void*>(at)) T(std::forward<Given>(given)...);
  }
};

}  // namespace carom
