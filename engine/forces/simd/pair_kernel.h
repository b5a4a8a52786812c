// SPDX-License-Identifier: BSD-3-Clause
// The kernels of pair_kernels.h, written once for any number of lanes. Only pair_kernels_*.cc include it, which are
// compiled for different instruction sets. Everything here has internal linkage and uses only raw pointers, so that the
// linker cannot use a function compiled for another instruction set.

#include "engine/forces/pair_formulas.h"
#include "engine/forces/potentials/pair_potentials.h"

namespace carom {
namespace {

template <class V>
struct Fields {
  V x, y, z, w;
};

/// The fields of the W records at the addresses `at(lane)`.
template <class V>
CAROM_INLINE Fields<V> transposed(const auto& at) {
  if constexpr (sizeof(V) == 16) {
    const V a = load<V>(&at(0)->x), b = load<V>(&at(1)->x), c = load<V>(&at(0)->z), d = load<V>(&at(1)->z);
    return {__builtin_shufflevector(a, b, 0, 2), __builtin_shufflevector(a, b, 1, 3),
            __builtin_shufflevector(c, d, 0, 2), __builtin_shufflevector(c, d, 1, 3)};
  } else if constexpr (sizeof(V) == 32) {
    const V a = load<V>(at(0)), b = load<V>(at(1)), c = load<V>(at(2)), d = load<V>(at(3));
    const V xz01 = __builtin_shufflevector(a, b, 0, 4, 2, 6), yw01 = __builtin_shufflevector(a, b, 1, 5, 3, 7);
    const V xz23 = __builtin_shufflevector(c, d, 0, 4, 2, 6), yw23 = __builtin_shufflevector(c, d, 1, 5, 3, 7);
    return {__builtin_shufflevector(xz01, xz23, 0, 1, 4, 5), __builtin_shufflevector(yw01, yw23, 0, 1, 4, 5),
            __builtin_shufflevector(xz01, xz23, 2, 3, 6, 7), __builtin_shufflevector(yw01, yw23, 2, 3, 6, 7)};
  } else {
    const auto both = [&](int lane) __attribute__((always_inline)) {
      return __builtin_shufflevector(load<Four>(at(lane)), load<Four>(at(lane + 4)), 0, 1, 2, 3, 4, 5, 6, 7);
    };
    const V a = both(0), b = both(1), c = both(2), d = both(3);
    const V xz01 = __builtin_shufflevector(a, b, 0, 8, 2, 10, 4, 12, 6, 14);
    const V yw01 = __builtin_shufflevector(a, b, 1, 9, 3, 11, 5, 13, 7, 15);
    const V xz23 = __builtin_shufflevector(c, d, 0, 8, 2, 10, 4, 12, 6, 14);
    const V yw23 = __builtin_shufflevector(c, d, 1, 9, 3, 11, 5, 13, 7, 15);
    return {__builtin_shufflevector(xz01, xz23, 0, 1, 8, 9, 4, 5, 12, 13),
            __builtin_shufflevector(yw01, yw23, 0, 1, 8, 9, 4, 5, 12, 13),
            __builtin_shufflevector(xz01, xz23, 2, 3, 10, 11, 6, 7, 14, 15),
            __builtin_shufflevector(yw01, yw23, 2, 3, 10, 11, 6, 7, 14, 15)};
  }
}

/// For each mask of four lanes, the 32-bit halves of the selected lanes, packed to the front.
struct Compression {
  alignas(32) std::uint32_t half[16][8];
  alignas(16) std::uint32_t lane[16][4];
  constexpr Compression() : half{}, lane{} {
    for (unsigned mask = 0; mask < 16; ++mask) {
      std::size_t n = 0;
      for (unsigned l = 0; l < 4; ++l)
        if ((mask >> l & 1) != 0) {
          half[mask][2 * n] = 2 * l, half[mask][2 * n + 1] = 2 * l + 1;
          lane[mask][n++] = l;
        }
    }
  }
};
constexpr Compression kCompression;

/// Stores the selected lanes consecutively; may write up to W numbers.
template <class V>
CAROM_INLINE void compress(double* to, unsigned mask, V x) {
#if defined(__AVX512F__)
  if constexpr (sizeof x == 64) {
    store(to, _mm512_maskz_compress_pd(static_cast<__mmask8>(mask), (__m512d)x));
    return;
  }
#endif
#if defined(__AVX2__)
  if constexpr (sizeof x == 32) {
    const __m256i which = _mm256_load_si256(reinterpret_cast<const __m256i*>(kCompression.half[mask]));
    store(to, _mm256_permutevar8x32_ps((__m256)x, which));
    return;
  }
#endif
  for (unsigned l = 0, n = 0; l < sizeof x / 8; n += mask >> l & 1, ++l) to[n] = x[l];
}
template <int W, class Places>
CAROM_INLINE void compress(std::uint32_t* to, unsigned mask, Places places) {
#if defined(__AVX512VL__)
  if constexpr (W == 8) {
    store(to, _mm256_maskz_compress_epi32(static_cast<__mmask8>(mask), (__m256i)places));
    return;
  }
#endif
#if defined(__AVX2__)
  if constexpr (W == 4) {
    const __m128i which = _mm_load_si128(reinterpret_cast<const __m128i*>(kCompression.lane[mask]));
    store(to, _mm_permutevar_ps((__m128)places, which));
    return;
  }
#endif
  for (unsigned l = 0, n = 0; l < W; n += mask >> l & 1, ++l) to[n] = places[l];
}

template <int W>
CAROM_INLINE unsigned bits_in(unsigned mask) {
  if constexpr (W == 2)
    return (mask & 1) + (mask >> 1);
  else
    return static_cast<unsigned>(__builtin_popcount(mask));  // an instruction wherever vectors are this wide
}

/// What a batch contains besides separations: nothing, new separations, or differences of vectors.
enum class Extra { nothing, step, vectors };

template <int W, Extra extra, bool moving, bool weighted>
bool collect_pairs(const PairRows& rows, PairCursor& cursor, PairBatch& batch) {
  using V = typename Width<W>::Double;
  batch.clear();
  unsigned n = 0;
  const V cutoff = all<V>(rows.cutoff_squared);
  const PairRecord* const records = rows.x;
  for (; cursor.run < rows.runs; ++cursor.run, cursor.at = 0) {
    const PairRun& run = rows.run[cursor.run];
    const std::uint32_t* const partner = rows.partner + run.begin;
    const PairRecord &own = rows.x[run.row], &own_new = extra == Extra::nothing ? own : rows.x_new[run.row];
    const V x = all<V>(own.x), y = all<V>(own.y), z = all<V>(own.z), w = all<V>(own.w);
    const V x_new = all<V>(own_new.x), y_new = all<V>(own_new.y), z_new = all<V>(own_new.z);
    V image[3], shift[3], shift_new = {}, above = {};
    for (int k = 0; k < 3; ++k) {
      const double* const box = moving ? &rows.box[run.row].x : nullptr;
      image[k] = all<V>(run.image[k] - (moving ? box[k] : 0));
      shift[k] = image[k] * rows.edges[k];
    }
    batch.n = n;
    batch.begin_row(run.row);
    const std::uint32_t count = run.count;
    std::uint32_t at = cursor.at, end = at;  // the batch has room for the partners before `end`
    unsigned mask = 0;
    for (;; at += W) {
      if (at >= end) {
        n -= bits_in<W>(mask >> (W - (at - end)));  // lanes beyond `end` belong to the next row
        const std::uint32_t most = (PairBatch::kCapacity - n) / W * W;
        if (at >= count || most == 0) break;
        end = count - at < most ? count : at + most;
      }
      const std::uint32_t* const j = partner + at;
      const auto other = transposed<V>([&](int l) __attribute__((always_inline)) { return records + j[l]; });
      if constexpr (moving) {
        const auto box = transposed<V>([&](int l) __attribute__((always_inline)) { return rows.box + j[l]; });
        shift[0] = (image[0] + box.x) * rows.edges[0];
        shift[1] = (image[1] + box.y) * rows.edges[1];
        shift[2] = (image[2] + box.z) * rows.edges[2];
        if (rows.sheared) [[unlikely]] {
          above = image[1] + box.y;
          const V whole = ((image[0] + box.x) + above * rows.turns) * rows.edges[0];
          shift[0] = whole + above * rows.tilt[0];
          shift_new = whole + above * rows.tilt[1];
        } else {
          shift_new = shift[0];
        }
      }
      const V dx = (x - other.x) + shift[0], dy = (y - other.y) + shift[1], dz = (z - other.z) + shift[2];
      const V rho = dx * dx + dy * dy + dz * dz;
      mask = less(rho, cutoff);
      V ex, ey, ez;
      if constexpr (extra != Extra::nothing) {
        const auto after = transposed<V>([&](int l) __attribute__((always_inline)) { return rows.x_new + j[l]; });
        ex = x_new - after.x, ey = y_new - after.y, ez = z_new - after.z;
        if constexpr (extra == Extra::step) {
          ex += moving ? shift_new : shift[0], ey += shift[1], ez += shift[2];
          mask |= less(ex * ex + ey * ey + ez * ez, cutoff);
        }
      }
      V product;
      if constexpr (weighted) {
        product = w * other.w;
        mask &= bits(product != 0.0);
      }
      compress(batch.d[0] + n, mask, dx);
      compress(batch.d[1] + n, mask, dy);
      compress(batch.d[2] + n, mask, dz);
      if constexpr (extra != Extra::nothing) {
        compress(batch.d_new[0] + n, mask, ex);
        compress(batch.d_new[1] + n, mask, ey);
        compress(batch.d_new[2] + n, mask, ez);
      }
      if constexpr (weighted) compress(batch.weight + n, mask, product);
      if (moving && rows.sheared) [[unlikely]]
        compress(batch.above + n, mask, above);
      compress<W>(batch.second + n, mask, load<typename Width<W>::Unsigned>(j));
      n += bits_in<W>(mask);
    }
    if (at < count) {
      cursor.at = at;
      break;
    }
  }
  batch.n = n;
  batch.pad();
  return n > 0;
}

template <int W, Extra extra>
constexpr decltype(&collect_pairs<W, extra, false, false>) kCollect[4] = {
    collect_pairs<W, extra, false, false>, collect_pairs<W, extra, false, true>, collect_pairs<W, extra, true, false>,
    collect_pairs<W, extra, true, true>};

template <int W>
bool collect(const PairRows& rows, PairCursor& cursor, PairBatch& batch) {
  const unsigned which = (rows.box ? 2 : 0) + (rows.weighted ? 1 : 0);
  if (!rows.x_new) return kCollect<W, Extra::nothing>[which](rows, cursor, batch);
  if (rows.vectors) return kCollect<W, Extra::vectors>[which](rows, cursor, batch);
  return kCollect<W, Extra::step>[which](rows, cursor, batch);
}

/// Adds the words to the sums of both particles.
template <int W>
void scatter(const PairBatch& batch, const std::int64_t (*words)[PairBatch::kPaddedCapacity], ForceWords* sums) {
  constexpr std::size_t L = W == 2 ? 2 : 4, kParts = 4 / L;  // a ForceWords has four words
  using I = IntegerOf<typename Width<L>::Double>;
  for (unsigned r = 0; r < batch.rows; ++r) {
    const unsigned end = batch.row[r + 1].begin;
    I own[kParts] = {};
    for (unsigned k = batch.row[r].begin; k < end; k += L == 4 ? 4 : 1) {
      if constexpr (L == 4) {  // pairs of the next row are masked to zero
        static constexpr std::int64_t kLanes[8] = {-1, -1, -1, -1};
        const I some = load<I>(kLanes + 4 - (end - k < 4 ? end - k : 4)), none = {};
        const I x = load<I>(words[0] + k) & some, y = load<I>(words[1] + k) & some, z = load<I>(words[2] + k) & some;
        const I xy02 = __builtin_shufflevector(x, y, 0, 4, 2, 6), xy13 = __builtin_shufflevector(x, y, 1, 5, 3, 7);
        const I z02 = __builtin_shufflevector(z, none, 0, 4, 2, 6), z13 = __builtin_shufflevector(z, none, 1, 5, 3, 7);
        const I term[4] = {
            __builtin_shufflevector(xy02, z02, 0, 1, 4, 5), __builtin_shufflevector(xy13, z13, 0, 1, 4, 5),
            __builtin_shufflevector(xy02, z02, 2, 3, 6, 7), __builtin_shufflevector(xy13, z13, 2, 3, 6, 7)};
        own[0] += (term[0] + term[1]) + (term[2] + term[3]);
        for (int l = 0; l < 4; ++l) {
          std::int64_t* const other = sums[batch.second[k + l]].of;
          store(other, load<I>(other) - term[l]);
        }
      } else {
        std::int64_t* const other = sums[batch.second[k]].of;
        const I xy = {words[0][k], words[1][k]}, z = {words[2][k], 0};
        own[0] += xy;
        own[kParts - 1] += z;
        store(other, load<I>(other) - xy);
        store(other + 2, load<I>(other + 2) - z);
      }
    }
    std::int64_t* const first = sums[batch.row[r].row].of;
    for (std::size_t part = 0; part < kParts; ++part) store(first + L * part, load<I>(first + L * part) + own[part]);
  }
}

template <int W>
void find_partners(const PartnerSearch& search, std::uint32_t begin, std::uint32_t end, PartnersFound& found) {
  using V = typename Width<W>::Double;
  using B = BitsOf<V>;
  using Places = typename Width<W>::Unsigned;
  const V x = all<V>(search.own[0]), y = all<V>(search.own[1]), z = all<V>(search.own[2]);
  const V reach = all<V>(search.reach_squared);
  const int to_sign = __builtin_clzll(search.wanted);
  Places places;
  for (unsigned l = 0; l < W; ++l) places[l] = begin + l;
  for (std::uint32_t j = begin; j < end; j += W, places += W) {
    const V dx = x - load<V>(search.x[0] + j), dy = y - load<V>(search.x[1] + j), dz = z - load<V>(search.x[2] + j);
    const B code = load<B>(search.code + j);
    unsigned mask = ~less(reach, dx * dx + dy * dy + dz * dz) & bits(code << to_sign);
    mask &= (1u << (end - j < W ? end - j : W)) - 1;
    if (!search.here && search.row - j < W) mask &= ~(1u << (search.row - j));
    const unsigned plain = search.plain ? mask & ~bits(code) : 0;
    compress<W>(found.plain, plain, places);
    found.plain += bits_in<W>(plain);
    if (plain == mask) continue;
    compress<W>(found.other, mask & ~plain, places);
    found.other += bits_in<W>(mask & ~plain);
  }
}

template <int W, class... P>
struct Formulas {
  static constexpr PairFormula kAll[] = {pair_formula<W, P>()...};
};

template <int W, class... P>
constexpr PairKernels pair_kernels_of(PotentialList<P...>) {
  return {width_name(W), collect<W>, scatter<W>, find_partners<W>, Formulas<W, P...>::kAll};
}

}  // namespace
}  // namespace carom
