// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What the next events will need is fetched while this one is at work.
//
// What an event needs is known step by step: the sphere, its partner and its list or cells, the candidates in these,
// their records. Each step takes a wait for memory, so they are spread over the events before.

#include "engine/events/event_queue.h"
#include "engine/search/linked_cells.h"
#include "engine/search/skin_lists.h"

namespace carom {

/// Fetches less where the core is not `large`: it stands in a cache.
template <int D>
void prefetch_upcoming(const EventQueue<D>& queue, const Flights<D>& flights, const SkinLists<D>& lists, bool large);

/// The same where there are cells and the core stands in a cache.
template <int D>
void prefetch_upcoming(const EventQueue<D>& queue, const Flights<D>& flights, const LinkedCells<D>& cells);

/// The same where it does not; `found` is room to work in.
template <int D>
void prefetch_upcoming(const EventQueue<D>& queue, const Flights<D>& flights, const LinkedCells<D>& cells,
                       Candidates& found);

}  // namespace carom
