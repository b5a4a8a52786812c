// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What the event core plans for one sphere.

#include <limits>

#include "engine/base/contact_log.h"
#include "engine/base/record.h"
#include "engine/search/cell_grid.h"

namespace carom {

/// Where a sphere stands in linked cells.
template <int D>
struct CellPlace {
  std::int32_t unwrapped[D];
  std::uint16_t wrapped[D];
  std::int32_t boxes;  ///< between the two, as a linear image (Packing)
};

/// The next contact of a sphere, if it was scanned after its partner, and when its surroundings must be looked at
/// again. One cache line.
template <int D>
struct alignas(64) NextEvent {
  double contact = std::numeric_limits<double>::infinity();
  double update = std::numeric_limits<double>::infinity();  ///< it leaves its cell, or the region its list is good for
  union Where {
    double centre[D];   ///< of the region: where the sphere was when its list was made
    CellPlace<D> cell;  ///< where the core works on cells alone
  } where{};
  std::uint32_t partner = 0;          ///< as a candidate (Packing); at a wall: its number
  std::uint32_t partner_version = 0;  ///< the contact is stale when the partner's has moved on
  std::uint32_t version = 0;          ///< grows with every contact of the sphere
  std::uint32_t list = 0;             ///< where its list starts, in units of ScanKernels::lanes candidates
  std::uint16_t count = 0;            ///< candidates in the list
  std::uint16_t capacity = 0;         ///< in the same units
  EventKind kind = EventKind::pair;
  std::uint8_t face = 0;   ///< it leaves its cell through: 2·axis + (0 downwards, 1 upwards)
  std::uint16_t same = 0;  ///< candidates at the start of the list that are in the same box

  double due() const { return contact < update ? contact : update; }
};
static_assert(sizeof(NextEvent<3>) == 64 && sizeof(NextEvent<2>) == 64);

}  // namespace carom
