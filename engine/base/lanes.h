#pragma once
// What a formula needs besides + − × ÷, comparisons and ?: to work on a double or on a vector of doubles alike.
//
//   template <class T> T value(T rho) const { return c_ / elementary::sqrt(rho); }
//
// T is double or a vector of the compiler (vector_size), one pair of particles a lane. Each lane gets the bits that the
// double would get: every function is made of the same IEEE operations. Vectors are for the kernels (pair_kernel.h),
// which are compiled once for each instruction set; everything here is inlined into them, so that no function compiled
// for one machine ends up in another's binary.

#include <cmath>
#include <concepts>

#if defined(__SSE2__)
#include <immintrin.h>
#endif

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

/// Unsigned 64-bit integers, as many as T has doubles; their bits are converted by __builtin_bit_cast.
template <class T>
using BitsOf = typename LanesOf<T>::Bits;
template <class T>
using IntegerOf = typename LanesOf<T>::Integer;

/// The same number in every lane.
template <class T>
[[gnu::always_inline]] inline T all(double value) {
  if constexpr (std::same_as<T, double>)
    return value;
  else
    return value - T{};
}

namespace elementary {

/// Whether a comparison holds in any lane.
[[gnu::always_inline]] inline bool any(bool mask) { return mask; }
template <class Mask>
requires(sizeof(Mask) > sizeof(long long)) [[gnu::always_inline]] inline bool any(Mask mask) {
#if defined(__AVX512DQ__)
  if constexpr (sizeof mask == 64) return _mm512_movepi64_mask((__m512i)mask) != 0;
#endif
#if defined(__AVX__)
  if constexpr (sizeof mask == 32) return _mm256_movemask_pd((__m256d)mask) != 0;
#endif
#if defined(__SSE2__)
  if constexpr (sizeof mask == 16) return _mm_movemask_pd((__m128d)mask) != 0;
#endif
  long long found = 0;
  for (unsigned l = 0; l < sizeof mask / sizeof found; ++l) found |= mask[l];
  return found != 0;
}

[[gnu::always_inline]] inline double sqrt(double x) { return __builtin_sqrt(x); }
template <Lanes T>
[[gnu::always_inline]] inline T sqrt(T x) {
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

/// |x|, also of −0.
template <class T>
[[gnu::always_inline]] inline T abs(T x) {
  return __builtin_bit_cast(T, __builtin_bit_cast(BitsOf<T>, x) & 0x7fffffffffffffffULL);
}
/// The lesser and the greater of two numbers; the second where one is no number.
template <class T>
[[gnu::always_inline]] inline T min(T a, T b) {
  return a < b ? a : b;
}
template <class T>
[[gnu::always_inline]] inline T max(T a, T b) {
  return a > b ? a : b;
}

/// The nearest integer, the even one of two, for |x| < 2^51.
template <class T>
[[gnu::always_inline]] inline T nearest_integer(T x) {
  return (x + 0x1.8p52) - 0x1.8p52;
}
/// 2^k for an integer −1022 ≤ k ≤ 1023.
template <class T>
[[gnu::always_inline]] inline T power_of_two(T k) {
  return __builtin_bit_cast(T, __builtin_bit_cast(BitsOf<T>, k + (0x1.8p52 + 1023)) << 52);
}

}  // namespace elementary
}  // namespace carom
