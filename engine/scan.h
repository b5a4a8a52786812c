#pragma once
// The innermost loops, compiled several times for different vector widths and chosen when a core is made.
//
// `scan` finds the first contact of one sphere among its candidates, several at a time and without branches; `near`
// finds the spheres around a place in the cells of skin_lists.h. All widths give the same bits: the same operations in
// the same order in every lane. The environment variable CAROM_SIMD (sse2, avx2 or avx512) forces a width.

#include <cstdint>

namespace carom {

/// What scans of one core have in common. Records are given as 8 doubles each (record.h).
struct ScanSetting {
  const double* records = nullptr;
  const double* radius = nullptr;  ///< by slot; null where all spheres have one diameter
  double diameter = 0;
  double edges[3] = {0, 0, 0};  ///< of the box, to multiply images with
  double g[3] = {0, 0, 0};      ///< common acceleration
  double growth = 0;            ///< contact distances are multiplied by 1 + growth·t
  std::uint32_t slot_mask = 0;  ///< of a candidate (Packing)
  int slot_bits = 0, field_bits = 0;
  bool plain = true;  ///< one diameter, no acceleration, no growth
};

struct ScanResult {
  double time;          ///< of the first contact; infinite: none; −infinite: two spheres overlap, look one by one
  std::uint32_t which;  ///< its place among the candidates
  bool tied;            ///< another contact may have the same time: look one by one
};

/// A sphere to scan for, whose record is later than those of its candidates, as after a collision.
struct ScanTask {
  std::uint32_t self;
  const std::uint32_t* candidates;
  unsigned n;
  bool shifted;
};

/// Eight spheres of a cell: places in 1024ths of the cell, ten bits an axis, and slots (kNobody where there is none).
struct alignas(64) CellLine {
  std::uint32_t place[8];
  std::uint32_t slot[8];
};
inline constexpr std::uint32_t kNobody = 0xffffffff;

/// A step to a cell along one axis, from that of the sphere who looks.
struct CellStep {
  std::uint32_t line;  ///< what it adds to the number of the cell's first line
  std::int32_t away;   ///< the boxes it leads through, as a linear image
  float offset;        ///< [1024ths of a cell]
  float squared;       ///< square of the distance to the nearest point of the cells there
};

struct NearTask {
  const CellLine* lines;
  const std::uint32_t* next;  ///< by line: the next line of the same cell, or kNobody
  const CellStep* step[3];    ///< along each axis
  unsigned steps[3];
  float at[3];     ///< where in its cell the sphere stands [1024ths]
  float scale[3];  ///< length of 1/1024 of a cell, by axis
  float limit_squared;
};

/// The kernels of one vector width.
struct ScanKernels {
  const char* name;
  /// The first contact of sphere `self` among n candidates, which are padded with `self` to a multiple of 8; `shifted`:
  /// some of them are not in the same box; `latest`: none of their records is of a later time than its own. By
  /// dimension − 2.
  ScanResult (*scan[2])(const ScanSetting&, std::uint32_t self, const std::uint32_t* candidates, unsigned n,
                        bool shifted, bool latest);
  /// The same for the two spheres of a collision.
  void (*scan_two[2])(const ScanSetting&, const ScanTask* task, ScanResult* result);
  /// Writes slots and linear images of the cells of all spheres within the limit; returns how many. The arrays must
  /// hold as many as there are in the cells.
  unsigned (*near)(const NearTask&, std::uint32_t* slots, std::int32_t* away);
};

/// The widest kernels this machine has, or those that CAROM_SIMD names. Throws Error(Failure::deck) where it names what
/// the machine does not have.
const ScanKernels& scan_kernels();

namespace kernels {
extern const ScanKernels sse2, avx2, avx512;
}

}  // namespace carom
