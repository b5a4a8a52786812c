// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The vector widths for which the innermost loops (search/simd, forces/simd) are compiled, and the choice between them
// when a program runs. The environment variable CAROM_SIMD forces one.

#include <cstddef>
#include <iterator>
#include <utility>
#include <vector>

namespace carom {

struct VectorWidth {
  const char* name;  ///< the value of CAROM_SIMD
  int lanes;         ///< doubles in a vector
};

/// The widths for this instruction set, the widest first; every processor has the last one.
inline constexpr VectorWidth kVectorWidths[] = {
#if defined(__x86_64__)
    {"avx512", 8},
    {"avx2", 4},
    {"sse2", 2},
#elif defined(__aarch64__)
    {"neon", 2},
#else
    {"two", 2},
#endif
};

constexpr const char* width_name(int lanes) {
  for (const VectorWidth& width : kVectorWidths)
    if (width.lanes == lanes) return width.name;
  return nullptr;
}

/// Indices in kVectorWidths of the widths that this machine has, or of the one that CAROM_SIMD names. Throws
/// Error(Failure::deck) if CAROM_SIMD names none that this machine has.
std::vector<std::size_t> vector_widths();

/// The kernels for vectors of `lanes` doubles. The file that is compiled for this width defines it.
template <class Kernels, int lanes>
const Kernels& kernels_of();

/// The kernels for vector_widths(), which may throw.
template <class Kernels>
std::vector<const Kernels*> available_kernels() {
  std::vector<const Kernels*> found;
  [&]<std::size_t... width>(std::index_sequence<width...>) {
    const Kernels* const all[] = {&kernels_of<Kernels, kVectorWidths[width].lanes>()...};
    for (const std::size_t each : vector_widths()) found.push_back(all[each]);
  }
  (std::make_index_sequence<std::size(kVectorWidths)>());
  return found;
}
template <class Kernels>
const Kernels& widest_kernels() {
  return *available_kernels<Kernels>().front();
}

}  // namespace carom
