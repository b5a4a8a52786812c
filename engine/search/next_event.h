// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The event that the event core plans for one sphere.

#include <limits>

#include "engine/base/record.h"
#include "engine/laws/contact_log.h"
#include "engine/search/cell_grid.h"

namespace carom {

/// The position of a sphere in linked cells.
template <int D>
struct CellPlace {
  std::int32_t unwrapped[D];
  std::uint16_t wrapped[D];
  std::int32_t boxes;  ///< difference of the two, as a linear image (Packing)
};

/// The next contact of a sphere, if the sphere was scanned after its partner, and the time at which its neighbourhood
/// must be updated. One cache line.
template <int D>
struct alignas(64) NextEvent {
  double contact = std::numeric_limits<double>::infinity();
  double update = std::numeric_limits<double>::infinity();  ///< when it leaves its cell, or its list's region
  union Where {
    double centre[D];   ///< centre of the region: the sphere's position when its list was made
    CellPlace<D> cell;  ///< if the core uses cells alone
  } where{};
  std::uint32_t partner = 0;          ///< as a candidate (Packing); for a wall, its number; for a kick, 0
  std::uint32_t partner_version = 0;  ///< the contact is stale if the partner's version is newer
  std::uint32_t version = 0;          ///< increases with every contact of the sphere
  std::uint32_t list = 0;             ///< start of its list, in units of kScanLanes candidates
  std::uint16_t count = 0;            ///< candidates in the list
  std::uint16_t capacity = 0;         ///< in units of kScanLanes candidates
  EventKind kind = EventKind::pair;
  std::uint8_t face = 0;   ///< the face through which it leaves: 2·axis + (0 downwards, 1 upwards)
  std::uint16_t same = 0;  ///< candidates at the start of the list that are in the same box

  double due() const { return contact < update ? contact : update; }
};
static_assert(sizeof(NextEvent<3>) == 64 && sizeof(NextEvent<2>) == 64);

}  // namespace carom
