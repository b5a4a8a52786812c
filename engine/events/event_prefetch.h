// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Prefetches the data of the next events while the current one is executed.
//
// The data of an event become known step by step: the sphere, its partner and its list or cells, the candidates in
// them, their records. Each step waits for memory, so the steps are spread over the preceding events.

#include "engine/events/event_queue.h"
#include "engine/search/large_spheres.h"
#include "engine/search/linked_cells.h"
#include "engine/search/skin_lists.h"

namespace carom {

// Both functions prefetch less if the core is not `large`, that is, fits into a cache.

template <int D>
void prefetch_upcoming(const EventQueue<D>& queue, const Flights<D>& flights, const SkinLists<D>& lists, bool large);

/// `found` is working memory.
template <int D>
void prefetch_upcoming(const EventQueue<D>& queue, const Flights<D>& flights, const LinkedCells<D>& cells,
                       const LargeSpheres<D>* larges, Candidates& found, bool large);

}  // namespace carom
