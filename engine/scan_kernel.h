// The kernels of scan.h, written once for any number of lanes. Included by scan_*.cc only, which are compiled for
// different instruction sets: everything here has internal linkage and uses nothing but raw pointers, so that no
// function compiled for one machine can end up in another's binary.

#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include "engine/scan.h"

namespace carom {
namespace {

template <int W>
struct Lanes {
  typedef double Double __attribute__((vector_size(8 * W)));
  typedef long long Long __attribute__((vector_size(8 * W)));
  typedef int Int __attribute__((vector_size(4 * W)));
  typedef unsigned Bits __attribute__((vector_size(4 * W)));
};
using Two = Lanes<2>::Double;
using Four = Lanes<4>::Double;
using Eight = Lanes<8>::Double;

template <int W>
using Double = typename Lanes<W>::Double;
template <int W>
using Long = typename Lanes<W>::Long;

inline Two load(const double* at) {
  Two pair;
  __builtin_memcpy(&pair, at, sizeof pair);
  return pair;
}
inline Four join(Two a, Two b) { return __builtin_shufflevector(a, b, 0, 1, 2, 3); }
inline Eight join(Four a, Four b) { return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7); }

/// Two neighbouring doubles of W records: `first` and `second` hold one each of all records.
inline void load_pairs(const double* const* record, int at, Two& first, Two& second) {
  const Two even = load(record[0] + at), odd = load(record[1] + at);
  first = __builtin_shufflevector(even, odd, 0, 2);
  second = __builtin_shufflevector(even, odd, 1, 3);
}
inline void load_pairs(const double* const* record, int at, Four& first, Four& second) {
  const Four even = join(load(record[0] + at), load(record[2] + at));
  const Four odd = join(load(record[1] + at), load(record[3] + at));
  first = __builtin_shufflevector(even, odd, 0, 4, 2, 6);
  second = __builtin_shufflevector(even, odd, 1, 5, 3, 7);
}
inline void load_pairs(const double* const* record, int at, Eight& first, Eight& second) {
  const Eight even =
      join(join(load(record[0] + at), load(record[2] + at)), join(load(record[4] + at), load(record[6] + at)));
  const Eight odd =
      join(join(load(record[1] + at), load(record[3] + at)), join(load(record[5] + at), load(record[7] + at)));
  first = __builtin_shufflevector(even, odd, 0, 8, 2, 10, 4, 12, 6, 14);
  second = __builtin_shufflevector(even, odd, 1, 9, 3, 11, 5, 13, 7, 15);
}

template <int W>
inline Double<W> square_root(Double<W> x) {
#if defined(__AVX512F__)
  if constexpr (W == 8) return (Eight)_mm512_sqrt_pd((__m512d)x);
#endif
#if defined(__AVX__)
  if constexpr (W == 4) return (Four)_mm256_sqrt_pd((__m256d)x);
#endif
#if defined(__SSE2__)
  if constexpr (W == 2) return (Two)_mm_sqrt_pd((__m128d)x);
#endif
  for (int l = 0; l < W; ++l) x[l] = __builtin_sqrt(x[l]);
  return x;
}

/// One bit a lane.
template <int W>
inline unsigned bits(Long<W> mask) {
#if defined(__AVX512DQ__)
  if constexpr (W == 8) return _mm512_movepi64_mask((__m512i)mask);
#endif
#if defined(__AVX__)
  if constexpr (W == 4) return static_cast<unsigned>(_mm256_movemask_pd((__m256d)mask));
#endif
#if defined(__SSE2__)
  if constexpr (W == 2) return static_cast<unsigned>(_mm_movemask_pd((__m128d)mask));
#endif
  unsigned all = 0;
  for (int l = 0; l < W; ++l) all |= (mask[l] != 0 ? 1u : 0u) << l;
  return all;
}

template <int W>
inline double smallest(Double<W> x) {
  if constexpr (W == 8) {
    const Four a = __builtin_shufflevector(x, x, 0, 1, 2, 3), b = __builtin_shufflevector(x, x, 4, 5, 6, 7);
    return smallest<4>(a < b ? a : b);
  } else if constexpr (W == 4) {
    const Two a = __builtin_shufflevector(x, x, 0, 1), b = __builtin_shufflevector(x, x, 2, 3);
    return smallest<2>(a < b ? a : b);
  } else {
    return x[0] < x[1] ? x[0] : x[1];
  }
}

template <int W>
inline Double<W> all(double x) {
  Double<W> lanes;
  for (int l = 0; l < W; ++l) lanes[l] = x;
  return lanes;
}

template <int D, int W, bool shifted, bool plain>
ScanResult scan_lanes(const ScanSetting& s, std::uint32_t self, const std::uint32_t* candidates, unsigned n) {
  using V = Double<W>;
  constexpr double kNever = __builtin_inf();
  const double* const own = s.records + std::size_t{8} * self;
  const V none = all<W>(kNever), overlapping = all<W>(-kNever), t_i = all<W>(own[2 * D]);
  V x_i[D], v_i[D];
  for (int k = 0; k < D; ++k) x_i[k] = all<W>(own[k]), v_i[k] = all<W>(own[D + k]);
  V sigma = all<W>(s.diameter);

  Long<W> place, which{}, tied{};
  for (int l = 0; l < W; ++l) place[l] = l;
  V best = none;
  for (unsigned at = 0; at < n; at += W, place += W) {
    const double* record[W];
    for (int l = 0; l < W; ++l) record[l] = s.records + std::size_t{8} * (candidates[at + l] & s.slot_mask);
    V field[2 * D + 2];  // x, v, t of the candidates, and what comes after
    for (int k = 0; k < 2 * D + 2; k += 2) load_pairs(record, k, field[k], field[k + 1]);
    const V t_j = field[2 * D];
    const V now = t_i > t_j ? t_i : t_j, s_i = now - t_i, s_j = now - t_j;
    V d[D], v[D];
    for (int k = 0; k < D; ++k) {
      d[k] = (x_i[k] + s_i * v_i[k]) - (field[k] + s_j * field[D + k]);
      v[k] = v_i[k] - field[D + k];
    }
    if constexpr (!plain) {
      const V half = 0.5 * (s_i * s_i - s_j * s_j), difference = s_i - s_j;
      for (int k = 0; k < D; ++k) {
        d[k] += half * s.g[k];
        v[k] += difference * s.g[k];
      }
    }
    if constexpr (shifted) {
      typename Lanes<W>::Bits code;
      __builtin_memcpy(&code, candidates + at, sizeof code);
      const unsigned mask = (1u << s.field_bits) - 1, zero = 1u << (s.field_bits - 1);
      for (int k = 0; k < D; ++k) {
        const auto image = (typename Lanes<W>::Int)((code >> (s.slot_bits + k * s.field_bits) & mask) - zero);
        d[k] += __builtin_convertvector(image, V) * s.edges[k];
      }
    }
    V b, d_squared, v_squared, cross;
    if constexpr (D == 3) {
      b = d[0] * v[0] + d[1] * v[1] + d[2] * v[2];
      d_squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
      v_squared = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
      const V z = d[0] * v[1] - d[1] * v[0], x = d[1] * v[2] - d[2] * v[1], y = d[2] * v[0] - d[0] * v[2];
      cross = x * x + y * y + z * z;
    } else {
      b = d[0] * v[0] + d[1] * v[1];
      d_squared = d[0] * d[0] + d[1] * d[1];
      v_squared = v[0] * v[0] + v[1] * v[1];
      const V z = d[0] * v[1] - d[1] * v[0];
      cross = z * z;
    }
    V time;
    if constexpr (plain) {
      const V c = d_squared - sigma * sigma;
      const V discriminant = v_squared * sigma * sigma - cross;
      time = now + c / (square_root<W>(discriminant) - b);
      time = (b < 0.0) & (discriminant > 0.0) ? time : none;
      time = (b < 0.0) & (c <= 0.0) ? overlapping : time;
    } else {
      if (s.radius)
        for (int l = 0; l < W; ++l) sigma[l] = s.radius[self] + s.radius[candidates[at + l] & s.slot_mask];
      // As contact_time() for growing spheres, contact.h.
      const V rate = sigma * s.growth, reach = sigma * (1.0 + s.growth * now);
      const V c = d_squared - reach * reach, falling = b - reach * rate, outrun = v_squared - rate * rate;
      const V discriminant = v_squared * reach * reach - cross + rate * (rate * d_squared - 2.0 * reach * b);
      const V root = square_root<W>(discriminant);
      time = now + (falling < 0.0 ? c / (root - falling) : (falling + root) / -outrun);
      time = (discriminant > 0.0) & ((falling < 0.0) | (outrun < 0.0)) ? time : none;
      time = (c <= 0.0) ? ((falling < 0.0) ? overlapping : none) : time;
    }
    tied |= (time == best) & (time < none);
    const Long<W> sooner = time < best;
    best = sooner ? time : best;
    which = sooner ? place : which;
  }
  const double first = smallest<W>(best);
  const unsigned lanes = bits<W>(best == first);
  const bool several = (lanes & (lanes - 1)) != 0 && first < kNever;
  return {first, static_cast<std::uint32_t>(which[__builtin_ctz(lanes)]), several || bits<W>(tied) != 0};
}

template <int D, int W>
ScanResult scan(const ScanSetting& s, std::uint32_t self, const std::uint32_t* candidates, unsigned n, bool shifted) {
  if (s.plain)
    return shifted ? scan_lanes<D, W, true, true>(s, self, candidates, n)
                   : scan_lanes<D, W, false, true>(s, self, candidates, n);
  return shifted ? scan_lanes<D, W, true, false>(s, self, candidates, n)
                 : scan_lanes<D, W, false, false>(s, self, candidates, n);
}

typedef int Ints __attribute__((vector_size(32)));
typedef float Floats __attribute__((vector_size(32)));

/// One bit a lane.
inline unsigned bits(Ints mask) {
#if defined(__AVX2__)
  return static_cast<unsigned>(_mm256_movemask_ps((__m256)mask));
#elif defined(__SSE2__)
  typedef int Half __attribute__((vector_size(16)));
  const Half low = __builtin_shufflevector(mask, mask, 0, 1, 2, 3), high = __builtin_shufflevector(mask, mask, 4, 5, 6, 7);
  return static_cast<unsigned>(_mm_movemask_ps((__m128)low) | _mm_movemask_ps((__m128)high) << 4);
#else
  unsigned all = 0;
  for (int l = 0; l < 8; ++l) all |= (mask[l] != 0 ? 1u : 0u) << l;
  return all;
#endif
}

/// Which spheres of a line are within the limit.
inline unsigned within(const NearTask& task, const CellLine& cell, const CellVisit& visit) {
  Ints place, slot;
  __builtin_memcpy(&place, cell.place, sizeof place);
  __builtin_memcpy(&slot, cell.slot, sizeof slot);
  const Floats x = (__builtin_convertvector(place & 1023, Floats) + (visit.offset[0] - task.at[0])) * task.scale[0];
  const Floats y = (__builtin_convertvector(place >> 10 & 1023, Floats) + (visit.offset[1] - task.at[1])) * task.scale[1];
  const Floats z = (__builtin_convertvector(place >> 20 & 1023, Floats) + (visit.offset[2] - task.at[2])) * task.scale[2];
  return bits((x * x + y * y + z * z < task.limit_squared) & (slot != -1));
}

unsigned near(const NearTask& task, const CellVisit* visits, unsigned n, std::uint32_t* slots, std::int32_t* away) {
  unsigned found = 0;
  for (unsigned start = 0; start < n; start += 8) {  // eight cells at a time: one bit for each of their spheres
    std::uint64_t hits = 0;
    const unsigned cells = n - start < 8 ? n - start : 8;
    for (unsigned q = 0; q < cells; ++q) {
      const CellVisit& visit = visits[start + q];
      hits |= static_cast<std::uint64_t>(within(task, task.lines[visit.line], visit)) << (8 * q);
      for (std::uint32_t line = task.next[visit.line]; line != kNobody; line = task.next[line]) {  // crowded cells
        unsigned more = within(task, task.lines[line], visit);
        for (; more != 0; more &= more - 1) {
          slots[found] = task.lines[line].slot[__builtin_ctz(more)];
          away[found++] = visit.away;
        }
      }
    }
    for (; hits != 0; hits &= hits - 1) {
      const int bit = __builtin_ctzll(hits);
      const CellVisit& visit = visits[start + static_cast<unsigned>(bit / 8)];
      slots[found] = task.lines[visit.line].slot[bit % 8];
      away[found++] = visit.away;
    }
  }
  return found;
}

}  // namespace
}  // namespace carom
