// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The functions, besides + − × ÷, comparisons and ?:, that a formula needs to work on a double and on a vector alike.
//
//   template <class T> T value(T rho) const { return c_ / elementary::sqrt(rho); }
//
// T is double or a vector type of the compiler (vector_size), with one pair of particles in each lane. Each lane gets
// the bits that the double would get, because every function uses the same IEEE operations. Vectors are for the kernels
// (pair_kernel.h), which are compiled once for each instruction set. Everything here is inlined into them, so that the
// linker cannot use a function compiled for another instruction set.

#include <cmath>
#include <concepts>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

#define CAROM_INLINE [[gnu::always_inline]] inline

namespace carom {

/// A vector of doubles.
template <class T>
concept Lanes = !std::same_as<T, double> && requires(T x) {
  x[0] + 0.0;
};

template <class T>
struct LanesOf {
  static constexpr int kCount = sizeof(T) / sizeof(double);
  typedef unsigned long long Bits __attribute__((vector_size(sizeof(T))));
  typedef long long Integer __attribute__((vector_size(sizeof(T))));
};
template <>
struct LanesOf<double> {
  static constexpr int kCount = 1;
  using Bits = unsigned long long;
  using Integer = long long;
};

/// Unsigned 64-bit integers, one for each double of T; __builtin_bit_cast converts between the two.
template <class T>
using BitsOf = typename LanesOf<T>::Bits;
template <class T>
using IntegerOf = typename LanesOf<T>::Integer;

/// A vector with this number in every lane.
template <class T>
CAROM_INLINE T all(double value) {
  if constexpr (std::same_as<T, double>)
    return value;
  else
    return value - T{};
}

/// The vectors of W lanes.
template <int W>
struct Width {
  typedef double Double __attribute__((vector_size(8 * W)));
  typedef int Int __attribute__((vector_size(4 * W)));
  typedef unsigned Unsigned __attribute__((vector_size(4 * W)));
};
using Two = Width<2>::Double;
using Four = Width<4>::Double;
using Eight = Width<8>::Double;

template <class V>
CAROM_INLINE V load(const void* at) {
  V lanes;
  __builtin_memcpy(&lanes, at, sizeof lanes);
  return lanes;
}
template <class V>
CAROM_INLINE void store(void* at, V lanes) {
  __builtin_memcpy(at, &lanes, sizeof lanes);
}

/// The sign bit of each lane, one bit a lane, for lanes of 32 or 64 bits.
template <class M>
CAROM_INLINE unsigned bits(M mask) {
  [[maybe_unused]] constexpr bool kHalf = sizeof mask[0] == 4;
#if defined(__AVX512DQ__)
  if constexpr (!kHalf && sizeof mask == 64) return _mm512_movepi64_mask((__m512i)mask);
#endif
#if defined(__AVX__)
  if constexpr (!kHalf && sizeof mask == 32) return static_cast<unsigned>(_mm256_movemask_pd((__m256d)mask));
  if constexpr (kHalf && sizeof mask == 32) return static_cast<unsigned>(_mm256_movemask_ps((__m256)mask));
#endif
#if defined(__SSE2__)
  if constexpr (!kHalf && sizeof mask == 16) return static_cast<unsigned>(_mm_movemask_pd((__m128d)mask));
  if constexpr (kHalf && sizeof mask == 16) return static_cast<unsigned>(_mm_movemask_ps((__m128)mask));
#endif
  unsigned all = 0;
  for (unsigned l = 0; l < sizeof mask / sizeof mask[0]; ++l)
    all += static_cast<unsigned>(mask[l] >> (8 * sizeof mask[0] - 1) & 1) << l;  // a sum: NEON adds lanes
  return all;
}

/// The mask a < b. GCC for SSE2 would split the conjunction of two comparisons into scalars.
template <class V>
CAROM_INLINE IntegerOf<V> below(V a, V b) {
#if defined(__SSE2__)
  if constexpr (sizeof a == 16) return (IntegerOf<V>)_mm_cmplt_pd((__m128d)a, (__m128d)b);
#endif
  return (IntegerOf<V>)(a < b);
}
/// The lanes with a < b, one bit a lane.
template <class V>
CAROM_INLINE unsigned less(V a, V b) {
#if defined(__AVX512F__)
  if constexpr (sizeof a == 64) return _mm512_cmp_pd_mask((__m512d)a, (__m512d)b, _CMP_LT_OQ);
#endif
  return bits(a < b);
}

namespace elementary {

/// Whether a comparison holds in any lane.
CAROM_INLINE bool any(bool mask) { return mask; }
template <class Mask>
requires(sizeof(Mask) > sizeof(long long)) CAROM_INLINE bool any(Mask mask) { return bits(mask) != 0; }

CAROM_INLINE double sqrt(double x) { return __builtin_sqrt(x); }
template <Lanes T>
CAROM_INLINE T sqrt(T x) {
#if defined(__AVX512F__)
  if constexpr (sizeof x == 64) return (T)_mm512_sqrt_pd((__m512d)x);
#endif
#if defined(__AVX__)
  if constexpr (sizeof x == 32) return (T)_mm256_sqrt_pd((__m256d)x);
#endif
#if defined(__SSE2__)
  if constexpr (sizeof x == 16) return (T)_mm_sqrt_pd((__m128d)x);
#endif
  for (int l = 0; l < LanesOf<T>::kCount; ++l) x[l] = __builtin_sqrt(x[l]);
  return x;
}

/// |x|; also correct for −0.
template <class T>
CAROM_INLINE T abs(T x) {
  return __builtin_bit_cast(T, __builtin_bit_cast(BitsOf<T>, x) & 0x7fffffffffffffffULL);
}
/// The minimum and the maximum of two numbers; the second number if either is NaN.
template <class T>
CAROM_INLINE T min(T a, T b) {
#if defined(__AVX512F__)
  if constexpr (sizeof a == 64) return (T)_mm512_min_pd((__m512d)a, (__m512d)b);
#endif
#if defined(__AVX__)
  if constexpr (sizeof a == 32) return (T)_mm256_min_pd((__m256d)a, (__m256d)b);
#endif
#if defined(__SSE2__)
  if constexpr (sizeof a == 16) return (T)_mm_min_pd((__m128d)a, (__m128d)b);
#endif
  return a < b ? a : b;
}
template <class T>
CAROM_INLINE T max(T a, T b) {
  return a > b ? a : b;
}

/// The nearest integer, ties to even, for |x| < 2^51.
template <class T>
CAROM_INLINE T nearest_integer(T x) {
  return (x + 0x1.8p52) - 0x1.8p52;
}
/// 2^k for an integer −1022 ≤ k ≤ 1023.
template <class T>
CAROM_INLINE T power_of_two(T k) {
  return __builtin_bit_cast(T, __builtin_bit_cast(BitsOf<T>, k + (0x1.8p52 + 1023)) << 52);
}

}  // namespace elementary
}  // namespace carom
