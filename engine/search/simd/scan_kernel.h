// SPDX-License-Identifier: BSD-3-Clause
// The kernels of scan.h for any number of lanes. Only scan_*.cc include this file and are compiled for different
// instruction sets: everything here has internal linkage and uses only raw pointers, so that no function that was
// compiled for one machine can be linked into another's code.

#include "engine/base/lanes.h"
#include "engine/search/simd/scan.h"

namespace carom {
namespace {

template <int W>
using Double = typename Width<W>::Double;

inline Four load_two(const double* low, const double* high) {
#if defined(__AVX__)
  return (Four)_mm256_insertf128_pd(_mm256_castpd128_pd256(_mm_loadu_pd(low)), _mm_loadu_pd(high), 1);
#else
  return __builtin_shufflevector(load<Two>(low), load<Two>(high), 0, 1, 2, 3);
#endif
}

/// Loads two consecutive doubles of W records: `first` and `second` get one of each record.
inline void load_pairs(const double* const* record, int at, Two& first, Two& second) {
  const Two even = load<Two>(record[0] + at), odd = load<Two>(record[1] + at);
  first = __builtin_shufflevector(even, odd, 0, 2);
  second = __builtin_shufflevector(even, odd, 1, 3);
}
inline void load_pairs(const double* const* record, int at, Four& first, Four& second) {
  const Four even = load_two(record[0] + at, record[2] + at);
  const Four odd = load_two(record[1] + at, record[3] + at);
  first = __builtin_shufflevector(even, odd, 0, 4, 2, 6);
  second = __builtin_shufflevector(even, odd, 1, 5, 3, 7);
}
template <int W>
inline double smallest(Double<W> x) {
  if constexpr (W == 4) {
    const Two a = __builtin_shufflevector(x, x, 0, 1), b = __builtin_shufflevector(x, x, 2, 3);
    return smallest<2>(a < b ? a : b);
  } else {
    return x[0] < x[1] ? x[0] : x[1];
  }
}

/// The formulas of next_step_time() in step_event.h: the time until pairs reach their cores or steps; ∞ or NaN: never.
/// Sets `near` for pairs within the margin of a surface. With R the distance of the surface and Δ the
/// discriminant, a root is |d² − R²|/(√Δ + |b|) or, if the pair first misses the inner surface, (√Δ + |b|)/v².
template <class V>
CAROM_INLINE V step_times(const ScanSetting& s, V b, V d_squared, V v_squared, V cross, IntegerOf<V>& near) {
  const V none = all<V>(__builtin_inf());
  V inside = all<V>(s.surfaces[0].distance), outside = none;
  near = (d_squared - s.surfaces[0].squared <= s.surfaces[0].margin) & (d_squared > 0.0);  // without the padding
  for (unsigned k = 1; k < s.surface_count; ++k) {
    const ScanSurface& surface = s.surfaces[k];
    const V gap = d_squared - surface.squared;
    near |= elementary::abs(gap) <= surface.margin;
    inside = gap < 0.0 ? inside : all<V>(surface.distance);
    outside = gap < 0.0 ? elementary::min(outside, all<V>(surface.distance)) : outside;
  }
  const V to_inside = v_squared * inside * inside - cross;
  const IntegerOf<V> enters = (b < 0.0) & (to_inside > 0.0);
  const V distance = enters ? inside : outside;
  const V sum = elementary::sqrt(enters ? to_inside : v_squared * outside * outside - cross) + elementary::abs(b);
  const IntegerOf<V> turns = (b <= 0.0) & ~enters;  // it misses the inner surface
  return (turns ? sum : elementary::abs(d_squared - distance * distance)) / (turns ? v_squared : sum);
}

enum class Pairs {
  plain,    // with ScanSetting::plain
  sheared,  // with ScanSetting::sheared
  general,  // without
  stepped   // plain ones with ScanSetting::surfaces
};

/// Writes the times of contact with n ≤ kScanBlock candidates, of which the first `same` are in the same box: ∞ or NaN
/// for no contact; −∞ if the two overlap and approach, or are within the margin of a surface. Returns the smallest time
/// in each lane; pairs within a margin do not count. `fresh`: the candidates have just been written by stores that
/// overlap, so that loading several at once is slow.
template <int D, int W, bool latest, Pairs pairs, bool fresh = false>
inline __attribute__((always_inline)) Double<W> contact_times(const ScanSetting& s, std::uint32_t self,
                                                              const std::uint32_t* candidates, unsigned n,
                                                              unsigned same, double* times) {
  using V = Double<W>;
  constexpr double kInfinite = __builtin_inf();
  const double* const records = s.records;
  const double* const own = records + std::size_t{8} * self;
  const std::uint32_t slot_mask = s.slot_mask;
  const V none = all<V>(kInfinite), t_i = all<V>(own[std::ptrdiff_t{2} * D]);
  V x_i[D], v_i[D];
  for (int k = 0; k < D; ++k) x_i[k] = all<V>(own[k]), v_i[k] = all<V>(own[D + k]);
  V sigma = all<V>(s.diameter), best = none;
  const auto look = [&]<bool shifted>(const std::uint32_t* some, double* to) __attribute__((always_inline)) {
    const double* record[W];
    for (int l = 0; l < W; ++l) record[l] = records + std::size_t{8} * (some[l] & slot_mask);
    V field[2 * D + 2];  // x, v, t of the candidates, and the next double
    for (int k = 0; k < 2 * D + 2; k += 2) load_pairs(record, k, field[k], field[k + 1]);
    // Separation and its rate as seen from the candidate: the formulas below are even in the sign.
    const V t_j = field[2 * D];
    const V now = latest ? t_i : t_i > t_j ? t_i : t_j, s_i = now - t_i, s_j = now - t_j;
    V d[D], v[D];
    for (int k = 0; k < D; ++k) {
      d[k] = (field[k] + s_j * field[D + k]) - (latest ? x_i[k] : x_i[k] + s_i * v_i[k]);
      v[k] = field[D + k] - v_i[k];
    }
    if constexpr (pairs == Pairs::general) {
      const V half = 0.5 * (s_i * s_i - s_j * s_j), difference = s_i - s_j;
      for (int k = 0; k < D; ++k) {
        d[k] -= half * s.g[k];
        v[k] -= difference * s.g[k];
      }
    }
    if constexpr (shifted) {
      typename Width<W>::Unsigned code;
      if constexpr (fresh)
        for (int l = 0; l < W; ++l) code[l] = some[l];
      else
        code = load<decltype(code)>(some);
      const unsigned mask = (1u << s.field_bits) - 1, zero = 1u << (s.field_bits - 1);
      V shift[D], boxes[D];
      for (int k = 0; k < D; ++k) {
        const auto image = (typename Width<W>::Int)((code >> (s.slot_bits + k * s.field_bits) & mask) - zero);
        boxes[k] = __builtin_convertvector(image, V);
        shift[k] = boxes[k] * s.edges[k];
      }
      const bool slides = pairs == Pairs::sheared || (pairs == Pairs::general && (s.tilt != 0 || s.slide != 0));
      if (slides) shift[0] += boxes[1] * s.tilt;
      for (int k = 0; k < D; ++k) d[k] -= shift[k];
      if (slides) {
        const V slide = boxes[1] * s.slide;
        d[0] -= slide * now;
        v[0] -= slide;
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
    if constexpr (pairs == Pairs::stepped) {
      IntegerOf<V> near;
      time = now + step_times(s, b, d_squared, v_squared, cross, near);
      best = elementary::min(near ? none : time, best);
      return store(to, near ? -none : time);
    } else if constexpr (pairs != Pairs::general) {
      const V c = d_squared - sigma * sigma;
      const V discriminant = v_squared * sigma * sigma - cross;
      time = now + c / (elementary::sqrt(discriminant) - b);
      const IntegerOf<V> parting = b >= 0.0;
      time = (V)((IntegerOf<V>)time | parting | (discriminant <= 0.0));  // all bits set: NaN
      time = (c <= 0.0) & ~parting ? all<V>(-kInfinite) : time;
    } else {
      if (s.radius)
        for (int l = 0; l < W; ++l) sigma[l] = s.radius[self] + s.radius[some[l] & slot_mask];
      // The formulas of contact_time() for growing spheres in contact.h.
      const V rate = sigma * s.growth, reach = sigma * (1.0 + s.growth * now);
      const V c = d_squared - reach * reach, falling = b - reach * rate, outrun = v_squared - rate * rate;
      const V discriminant = v_squared * reach * reach - cross + rate * (rate * d_squared - 2.0 * reach * b);
      const V root = elementary::sqrt(discriminant);
      time = now + (falling < 0.0 ? c / (root - falling) : (falling + root) / -outrun);
      time = (discriminant > 0.0) & ((falling < 0.0) | (outrun < 0.0)) ? time : none;
      time = (c <= 0.0) ? (((falling < 0.0) & (d_squared > 0.0)) ? all<V>(-kInfinite) : none)
                        : time;  // without the padding
    }
    store(to, time);
    best = elementary::min(time, best);
  };
  const unsigned surely = same == n ? n : same / W * W;  // the padding is in the same box
  unsigned q = 0;
  for (; q < surely; q += W) look.template operator()<false>(candidates + q, times + q);
  for (; q < n; q += W) look.template operator()<true>(candidates + q, times + q);
  return best;
}

/// The indices, as bits, at which n times have this value.
template <int W>
inline std::uint64_t places_of(double value, const double* times, unsigned n) {
  std::uint64_t at = 0;
  for (unsigned q = 0; q < n; q += W) {
    at |= static_cast<std::uint64_t>(bits(load<Double<W>>(times + q) == value)) << q;
  }
  return at;
}

/// Finds the first of n times, given the smallest time in each lane.
template <int W>
inline ScanResult first_of(const double* times, unsigned n, Double<W> best) {
  const double first = smallest<W>(best);
  const std::uint64_t at = places_of<W>(first, times, n);
  return {first, static_cast<std::uint32_t>(__builtin_ctzll(at | std::uint64_t{1} << 63)), (at & (at - 1)) != 0};
}

template <int D, int W, bool latest, Pairs pairs>
__attribute__((noinline)) ScanResult scan_blocks(const ScanSetting& s, const ScanTask& task) {
  alignas(64) double times[kScanBlock];
  ScanResult result{__builtin_inf(), 0, false};
  for (unsigned start = 0; start < task.n; start += kScanBlock) {
    const unsigned n = task.n - start < kScanBlock ? task.n - start : kScanBlock;
    const unsigned same = task.same > start ? (task.same - start < n ? task.same - start : n) : 0;
    const auto best = contact_times<D, W, latest, pairs>(s, task.self, task.candidates + start, n, same, times);
    const ScanResult some = first_of<W>(times, n, best);
    if (some.time < result.time)
      result = {some.time, start + some.which, some.tied};
    else if (some.time == result.time)
      result.tied = true;
  }
  return result;
}

template <int D, int W, bool latest>
ScanResult scan_plain(const ScanSetting& s, const ScanTask& task) {
  if (task.n > kScanBlock) return scan_blocks<D, W, latest, Pairs::plain>(s, task);
  alignas(64) double times[kScanBlock];
  const auto best = contact_times<D, W, latest, Pairs::plain>(s, task.self, task.candidates, task.n, task.same, times);
  return first_of<W>(times, task.n, best);
}

template <int D, int W>
ScanResult scan(const ScanSetting& s, const ScanTask& task, bool latest) {
  if (s.sheared) return scan_blocks<D, W, false, Pairs::sheared>(s, task);
  if (!s.plain) return scan_blocks<D, W, false, Pairs::general>(s, task);
  return latest ? scan_plain<D, W, true>(s, task) : scan_plain<D, W, false>(s, task);
}

/// As scan(), for pairs with surfaces.
template <int D, int W>
StepScan scan_steps(const ScanSetting& s, const ScanTask& task) {
  alignas(64) double times[kScanBlock];
  const auto best = contact_times<D, W, false, Pairs::stepped>(s, task.self, task.candidates, task.n, task.same, times);
  return {first_of<W>(times, task.n, best), places_of<W>(-__builtin_inf(), times, task.n)};
}

/// Scans two spheres at once, so that the processor overlaps the end of one scan with the start of the other.
template <int D, int W>
void scan_two(const ScanSetting& s, const ScanTask* task, ScanResult* result) {
  if (!s.plain || task[0].n > kScanBlock || task[1].n > kScanBlock) {
    for (int k = 0; k < 2; ++k) result[k] = scan<D, W>(s, task[k], true);
    return;
  }
  alignas(64) double times[2][kScanBlock];
  Double<W> best[2];
  for (int k = 0; k < 2; ++k)
    best[k] =
        contact_times<D, W, true, Pairs::plain>(s, task[k].self, task[k].candidates, task[k].n, task[k].same, times[k]);
  for (int k = 0; k < 2; ++k) result[k] = first_of<W>(times[k], task[k].n, best[k]);
}

#if defined(__AVX__)
constexpr unsigned kInts = 8;
#else
constexpr unsigned kInts = 4;
#endif
using Ints = Width<kInts>::Int;
typedef float Floats __attribute__((vector_size(4 * kInts)));

template <bool sheared>
unsigned near_spheres(const NearTask& task, std::uint32_t* slots, std::int32_t* away) {
  const Floats scale_x = Floats{} + task.scale[0], scale_y = Floats{} + task.scale[1],
               scale_z = Floats{} + task.scale[2], limit = Floats{} + task.limit_squared;
  const float limit_squared = task.cells_squared;
  unsigned found = 0;
  struct Place {  // a line, and the corner of its cell as seen from the sphere
    std::uint32_t line;
    std::int32_t boxes;
    float x, y, z;
  } places[8];
  unsigned lines = 0;
  const auto within = [&](const Place& at, const CellLine& line) {
    unsigned inside = 0;
    for (unsigned first = 0; first < 8; first += kInts) {
      const Ints place = load<Ints>(line.place + first), slot = load<Ints>(line.slot + first);
      Floats x = __builtin_convertvector(place & 1023, Floats) * scale_x + at.x;
      const Floats y = __builtin_convertvector(place >> 10 & 1023, Floats) * scale_y + at.y;
      const Floats z = __builtin_convertvector(place >> 20, Floats) * scale_z + at.z;
      if constexpr (sheared) {
        x += task.mean_strain * y;
        x = x < 0.0f ? -x : x;
        x -= task.half_strain * (y < 0.0f ? -y : y);
        x = x < 0.0f ? Floats{} : x;
      }
      inside |= bits((x * x + y * y + z * z < limit) & (slot != -1)) << first;
    }
    return inside;
  };
  const auto take = [&](std::uint32_t slot, std::int32_t boxes) {
    slots[found] = slot;
    away[found++] = boxes;
  };
  const auto flush = [&] {
    std::uint64_t hits = 0;  // in eight lines, one bit for each sphere
    for (unsigned l = 0; l < lines; ++l) {
      const Place& at = places[l];
      hits |= static_cast<std::uint64_t>(within(at, task.lines[at.line])) << (8 * l);
      for (std::uint32_t more = task.next[at.line]; more != kEmpty; more = task.next[more])  // crowded cells
        for (unsigned m = within(at, task.lines[more]); m != 0; m &= m - 1)
          take(task.lines[more].slot[__builtin_ctz(m)], at.boxes);
    }
    for (; hits != 0; hits &= hits - 1) {
      const int bit = __builtin_ctzll(hits);
      take(task.lines[places[bit / 8].line].slot[bit % 8], places[bit / 8].boxes);
    }
    lines = 0;
  };
  const CellView* const view = task.view[2];
  const unsigned views = task.views[2];
  for (unsigned a = 0; a < task.views[0]; ++a) {
    const CellView p = task.view[0][a];
    for (unsigned b = 0; b < task.views[1]; ++b) {
      const CellView q = task.view[1][b];
      const std::uint32_t line = p.line + q.line;
      const std::int32_t boxes = p.away + q.away;
      const float left = limit_squared - p.squared - q.squared;
      for (unsigned c = 0; c < views; ++c) {
        const CellView& r = view[c];
        places[lines] = {line + r.line, boxes + r.away, p.corner, q.corner, r.corner};
        lines += r.squared < left ? 1 : 0;
        if (lines == 8) flush();
      }
    }
  }
  flush();
  return found;
}

[[maybe_unused]] unsigned near(const NearTask& task, std::uint32_t* slots, std::int32_t* away) {
  return task.half_strain == 0 ? near_spheres<false>(task, slots, away) : near_spheres<true>(task, slots, away);
}

[[maybe_unused]] unsigned compare(const std::uint32_t* list, unsigned length, const std::uint32_t* candidates,
                                  unsigned n, std::uint32_t* fresh, std::uint64_t* kept) {
  unsigned count = 0;
  for (unsigned q = 0; q < n; ++q) {
    const Ints one = Ints{} + static_cast<int>(candidates[q]);
    unsigned hit = 0;
    for (unsigned p = 0; p < length; p += kInts) {
      const unsigned inside = (1u << (length - p < kInts ? length - p : kInts)) - 1;
      const unsigned same = bits(load<Ints>(list + p) == one) & inside;
      hit |= same;
      kept[p / 64] |= static_cast<std::uint64_t>(same) << (p % 64);
    }
    fresh[count] = candidates[q];
    count += hit == 0 ? 1 : 0;
  }
  return count;
}

using Quad = Width<4>::Unsigned;
using Octet = Width<8>::Unsigned;

/// Moves the elements that a mask selects to the front of a vector.
inline Quad pack(Quad four, unsigned mask) {
#if defined(__SSSE3__)
  alignas(16) static const unsigned char order[8][16] = {{},
                                                         {0, 1, 2, 3},
                                                         {4, 5, 6, 7},
                                                         {0, 1, 2, 3, 4, 5, 6, 7},
                                                         {8, 9, 10, 11},
                                                         {0, 1, 2, 3, 8, 9, 10, 11},
                                                         {4, 5, 6, 7, 8, 9, 10, 11},
                                                         {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}};
  return (Quad)_mm_shuffle_epi8((__m128i)four, _mm_load_si128((const __m128i*)order[mask]));
#else
  Quad packed{};
  for (unsigned l = 0, to = 0; l < 3; ++l)
    if ((mask >> l & 1) != 0) packed[to++] = four[l];
  return packed;
#endif
}

#if defined(__AVX2__)
/// Moves the elements that a mask selects to the front of a vector. Elements 3 and 7 are never selected.
inline Octet pack(Octet eight, unsigned mask) {
  struct Orders {
    unsigned char of[128][8];
  };
  static constexpr Orders orders = [] {
    Orders all{};
    for (unsigned chosen = 0; chosen < 128; ++chosen)
      for (unsigned char l = 0, to = 0; l < 8; ++l)
        if ((chosen >> l & 1) != 0) all.of[chosen][to++] = l;
    return all;
  }();
  const __m256i order = _mm256_cvtepu8_epi32(_mm_loadl_epi64((const __m128i*)orders.of[mask]));
  return (Octet)_mm256_permutevar8x32_epi32((__m256i)eight, order);
}
#endif
inline Octet join(Quad a, Quad b) { return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7); }

/// Writes the heads, as seen from the box of the sphere, and pads them with the sphere. Returns their end, and all bits
/// in which they differ from the sphere in `any`.
inline std::uint32_t* read_heads(const CellsTask& task, std::uint32_t& any) {
  const std::uint32_t* const first = task.first;
  const Quad wanted = load<Quad>(task.wanted), self = Quad{} + task.self, away = Quad{} + task.away;
  std::uint32_t* end = task.candidates;
  const HeadStep* row = task.rows->step;
  unsigned rows = task.rows->count - 1;  // and the last one
  Quad differ{};
#if defined(__AVX2__)
  Octet differ_in_two{};
  for (; rows >= 2; rows -= 2, row += 2) {
    const Octet heads = join(load<Quad>(first + row[0].offset), load<Quad>(first + row[1].offset));
    const Octet filled = join(wanted, wanted) & ~(Octet)(heads == kEmpty);
    const Octet seen = heads - join(load<Quad>(row[0].away), load<Quad>(row[1].away)) - join(away, away);
    differ_in_two |= (seen ^ join(self, self)) & filled;
    const unsigned mask = bits(filled);
    store(end, pack(seen, mask));
    end += __builtin_popcount(mask);
  }
  differ = __builtin_shufflevector(differ_in_two, differ_in_two, 0, 1, 2, 3) |
           __builtin_shufflevector(differ_in_two, differ_in_two, 4, 5, 6, 7);
#endif
  const auto read = [&](std::uint32_t left_out) __attribute__((always_inline)) {
    const Quad heads = load<Quad>(first + row->offset);
    const Quad filled = wanted & ~((Quad)(heads == kEmpty) | (Quad)(heads == left_out));
    const Quad seen = heads - load<Quad>(row->away) - away;
    differ |= (seen ^ self) & filled;
    const unsigned mask = bits(filled);
    store(end, pack(seen, mask));
    end += __builtin_popcount(mask);
  };
  for (; rows > 0; --rows, ++row) read(kEmpty);
  read(task.own);
  store(end, self);
  differ |= __builtin_shufflevector(differ, differ, 2, 3, 0, 1);
  any = differ[0] | differ[1];
  return end;
}

[[maybe_unused]] void heads(CellsTask& task) {
  std::uint32_t any;
  task.count = static_cast<unsigned>(read_heads(task, any) - task.candidates);
}

/// Appends the later spheres of all cells in which a first one was found, and the padding, as far as there is room.
__attribute__((noinline)) std::uint32_t* follow(const ScanSetting& s, const CellsTask& task, std::uint32_t* end,
                                                std::uint32_t& any) {
  const std::uint32_t here = task.self & ~s.slot_mask;
  const std::uint32_t* const room = task.candidates + task.room - 8;
  for (std::uint32_t* at = task.candidates; at < end; ++at) {
    if ((*at & kMoreInCell) == 0) continue;
    *at &= ~kMoreInCell;
    // The box that was subtracted from the candidate is subtracted from the next one, too.
    const CellLink& link = task.link[*at & s.slot_mask];
    const std::uint32_t box = here + (static_cast<std::uint32_t>(link.boxes) << s.slot_bits) - (*at & ~s.slot_mask);
    any |= (link.next - box) ^ here;
    if (end == room) break;
    *end++ = link.next - box;
  }
  for (unsigned l = 0; l < kScanLanes; ++l) end[l] = task.self;
  return end;
}

template <int D, int W>
ScanResult search(const ScanSetting& s, CellsTask& task, bool latest) {
  std::uint32_t any;
  std::uint32_t* end = read_heads(task, any);
  if ((any & kMoreInCell) != 0) [[unlikely]]
    end = follow(s, task, end, any);
  task.count = static_cast<unsigned>(end - task.candidates);
  task.same = (any & ~kMoreInCell) >> s.slot_bits == 0 ? task.count : 0;
  const std::uint32_t self = task.self & s.slot_mask;
  if (task.count == 0) return {__builtin_inf(), 0, false};
  if (!s.plain || task.count > kScanBlock) return scan<D, W>(s, {self, task.candidates, task.count, task.same}, latest);
  alignas(64) double times[kScanBlock];
  const auto best =
      latest ? contact_times<D, W, true, Pairs::plain, true>(s, self, task.candidates, task.count, task.same, times)
             : contact_times<D, W, false, Pairs::plain, true>(s, self, task.candidates, task.count, task.same, times);
  return first_of<W>(times, task.count, best);
}

template <int D>
Crossing crossing(const CellFaces& faces, const double* record, const std::int32_t* cell) {
  const Four x = load<Four>(record), at_v = load<Four>(record + D);
  // The last double of a record in two dimensions is the id, a denormal number, by which division is slow.
  const Four v = D == 2 ? __builtin_shufflevector(at_v, at_v, 0, 1, 0, 1) : at_v;
  const IntegerOf<Four> down = v < 0.0;
  const Four c = __builtin_convertvector(load<Width<4>::Int>(cell), Four) + (down ? Four{} : all<Four>(1));
  const Four face = load<Four>(faces.origin) + c * load<Four>(faces.edge);
  const Four none = all<Four>(__builtin_inf());
  Four after = elementary::abs(face - x) / elementary::abs(v);
  after = ((c > load<Four>(faces.lowest)) & (c < load<Four>(faces.highest))) ? after : none;
  after = elementary::min(after, none);  // instead of 0/0
  const double first = smallest<4>(after);
  const auto axis = static_cast<unsigned>(__builtin_ctz(bits(after == first)));
  return {first, 2 * axis + (~bits(down) >> axis & 1)};
}

/// The kernels that look at W candidates at once.
template <int W>
constexpr ScanKernels scan_kernels_of() {
  return {{scan<2, W>, scan<3, W>},
          {scan_two<2, W>, scan_two<3, W>},
          {scan_steps<2, W>, scan_steps<3, W>},
          near,
          compare,
          heads,
          {search<2, W>, search<3, W>},
          {crossing<2>, crossing<3>}};
}

}  // namespace
}  // namespace carom
