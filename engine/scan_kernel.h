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

/// The first contact in every lane.
template <int W>
struct First {
  Double<W> time;
  Long<W> which, tied;
};

template <int W>
inline ScanResult finish(const First<W>& lanes) {
  const double first = smallest<W>(lanes.time);
  const unsigned at = bits<W>(lanes.time == first);
  const bool several = (at & (at - 1)) != 0 && first < __builtin_inf();
  return {first, static_cast<std::uint32_t>(lanes.which[__builtin_ctz(at)]), several || bits<W>(lanes.tied) != 0};
}

template <int D, int W, bool shifted, bool latest, bool plain>
inline __attribute__((always_inline)) First<W> scan_lanes(const ScanSetting& s, std::uint32_t self,
                                                          const std::uint32_t* candidates, unsigned n) {
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
  const double* const records = s.records;
  const std::uint32_t slot_mask = s.slot_mask;
  for (const std::uint32_t* const end = candidates + n; candidates < end; candidates += W, place += W) {
    const double* record[W];
    for (int l = 0; l < W; ++l) record[l] = records + std::size_t{8} * (candidates[l] & slot_mask);
    V field[2 * D + 2];  // x, v, t of the candidates, and what comes after
    for (int k = 0; k < 2 * D + 2; k += 2) load_pairs(record, k, field[k], field[k + 1]);
    const V t_j = field[2 * D];
    const V now = latest ? t_i : t_i > t_j ? t_i : t_j, s_i = now - t_i, s_j = now - t_j;
    V d[D], v[D];
    for (int k = 0; k < D; ++k) {
      d[k] = (latest ? x_i[k] : x_i[k] + s_i * v_i[k]) - (field[k] + s_j * field[D + k]);
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
      __builtin_memcpy(&code, candidates, sizeof code);
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
        for (int l = 0; l < W; ++l) sigma[l] = s.radius[self] + s.radius[candidates[l] & slot_mask];
      // As contact_time() for growing spheres, contact.h.
      const V rate = sigma * s.growth, reach = sigma * (1.0 + s.growth * now);
      const V c = d_squared - reach * reach, falling = b - reach * rate, outrun = v_squared - rate * rate;
      const V discriminant = v_squared * reach * reach - cross + rate * (rate * d_squared - 2.0 * reach * b);
      const V root = square_root<W>(discriminant);
      time = now + (falling < 0.0 ? c / (root - falling) : (falling + root) / -outrun);
      time = (discriminant > 0.0) & ((falling < 0.0) | (outrun < 0.0)) ? time : none;
      time = (c <= 0.0) ? ((falling < 0.0) & (d_squared > 0.0) ? overlapping : none) : time;  // but for the padding
    }
    tied |= (time == best) & (time < none);
    const Long<W> sooner = time < best;
    best = sooner ? time : best;
    which = sooner ? place : which;
  }
  return {best, which, tied};
}

template <int D, int W>
ScanResult scan(const ScanSetting& s, std::uint32_t self, const std::uint32_t* candidates, unsigned n, bool shifted,
                bool latest) {
  if (!s.plain) return finish<W>(scan_lanes<D, W, true, false, false>(s, self, candidates, n));
  if (shifted)
    return latest ? finish<W>(scan_lanes<D, W, true, true, true>(s, self, candidates, n))
                  : finish<W>(scan_lanes<D, W, true, false, true>(s, self, candidates, n));
  return latest ? finish<W>(scan_lanes<D, W, false, true, true>(s, self, candidates, n))
                : finish<W>(scan_lanes<D, W, false, false, true>(s, self, candidates, n));
}

/// Two at once: the end of one and the start of the other overlap in the processor.
template <int D, int W>
void scan_two(const ScanSetting& s, const ScanTask* task, ScanResult* result) {
  if (!s.plain) {
    for (int k = 0; k < 2; ++k)
      result[k] = finish<W>(scan_lanes<D, W, true, false, false>(s, task[k].self, task[k].candidates, task[k].n));
  } else if (task[0].shifted || task[1].shifted) {
    const First<W> a = scan_lanes<D, W, true, true, true>(s, task[0].self, task[0].candidates, task[0].n);
    const First<W> b = scan_lanes<D, W, true, true, true>(s, task[1].self, task[1].candidates, task[1].n);
    result[0] = finish<W>(a);
    result[1] = finish<W>(b);
  } else {
    const First<W> a = scan_lanes<D, W, false, true, true>(s, task[0].self, task[0].candidates, task[0].n);
    const First<W> b = scan_lanes<D, W, false, true, true>(s, task[1].self, task[1].candidates, task[1].n);
    result[0] = finish<W>(a);
    result[1] = finish<W>(b);
  }
}

typedef int Ints __attribute__((vector_size(32)));
typedef float Floats __attribute__((vector_size(32)));

/// One bit a lane.
inline unsigned bits(Ints mask) {
#if defined(__AVX2__)
  return static_cast<unsigned>(_mm256_movemask_ps((__m256)mask));
#elif defined(__SSE2__)
  typedef int Half __attribute__((vector_size(16)));
  const Half low = __builtin_shufflevector(mask, mask, 0, 1, 2, 3),
             high = __builtin_shufflevector(mask, mask, 4, 5, 6, 7);
  return static_cast<unsigned>(_mm_movemask_ps((__m128)low) | _mm_movemask_ps((__m128)high) << 4);
#else
  unsigned all = 0;
  for (int l = 0; l < 8; ++l) all |= (mask[l] != 0 ? 1u : 0u) << l;
  return all;
#endif
}

/// Which spheres of a line are within the limit.
inline unsigned within(const NearTask& task, const CellLine& cell, float x0, float y0, float z0) {
  Ints place, slot;
  __builtin_memcpy(&place, cell.place, sizeof place);
  __builtin_memcpy(&slot, cell.slot, sizeof slot);
  const Floats x = (__builtin_convertvector(place & 1023, Floats) + x0) * task.scale[0];
  const Floats y = (__builtin_convertvector(place >> 10 & 1023, Floats) + y0) * task.scale[1];
  const Floats z = (__builtin_convertvector(place >> 20 & 1023, Floats) + z0) * task.scale[2];
  return bits((x * x + y * y + z * z < task.limit_squared) & (slot != -1));
}

[[maybe_unused]] unsigned near(const NearTask& task, std::uint32_t* slots, std::int32_t* away) {
  unsigned found = 0, cells = 0;
  std::uint32_t line[8];
  std::int32_t box[8];
  std::uint64_t hits = 0;  // of eight cells, one bit for each of their spheres
  const auto flush = [&] {
    for (; hits != 0; hits &= hits - 1) {
      const int bit = __builtin_ctzll(hits);
      slots[found] = task.lines[line[bit / 8]].slot[bit % 8];
      away[found++] = box[bit / 8];
    }
    cells = 0;
  };
  for (unsigned a = 0; a < task.steps[0]; ++a)
    for (unsigned b = 0; b < task.steps[1]; ++b) {
      const CellStep &p = task.step[0][a], &q = task.step[1][b];
      const float squared = p.squared + q.squared;
      if (!(squared < task.limit_squared)) continue;
      for (unsigned c = 0; c < task.steps[2]; ++c) {
        const CellStep& r = task.step[2][c];
        const float x0 = p.offset - task.at[0], y0 = q.offset - task.at[1], z0 = r.offset - task.at[2];
        line[cells] = p.line + q.line + r.line;
        box[cells] = p.away + q.away + r.away;
        hits |= static_cast<std::uint64_t>(within(task, task.lines[line[cells]], x0, y0, z0)) << (8 * cells);
        for (std::uint32_t l = task.next[line[cells]]; l != kNobody; l = task.next[l])  // crowded cells
          for (unsigned more = within(task, task.lines[l], x0, y0, z0); more != 0; more &= more - 1) {
            slots[found] = task.lines[l].slot[__builtin_ctz(more)];
            away[found++] = box[cells];
          }
        if (++cells == 8) flush();
      }
    }
  flush();
  return found;
}

}  // namespace
}  // namespace carom
