// What the next events will need is fetched while this one is at work.
//
// What an event needs is known step by step: the sphere, its partner and its list or cells, the candidates in these,
// their records. Each step takes a wait for memory, so they are spread over the events before.

#include "engine/events/event_core.h"

namespace carom {

template <int D>
void EventCore<D>::prefetch_upcoming() {
  if (lists_)
    prefetch_lists();
  else if (large_)
    prefetch_cells();
  else
    prefetch_few_cells();
}

template <int D>
void EventCore<D>::prefetch_lists() const {
  const auto prefetch_candidates = [&](const NextEvent<D>& a) {
    const std::uint32_t* const list = lists_->candidates(a);
    for (unsigned q = 0; q < a.count; ++q) prefetch_line(&flights_[packing_.slot(list[q])]);
  };
  if (const CalendarEntry* const later = calendar_.upcoming(large_ ? 8 : 3)) prefetch(later->slot);
  if (const CalendarEntry* const later = calendar_.upcoming(large_ ? 5 : 1)) {
    const NextEvent<D>& a = next_events_[later->slot];
    lists_->prefetch(a);
    if (meets(a)) prefetch(packing_.slot(a.partner));
  }
  if (const CalendarEntry* const later = calendar_.upcoming(large_ ? 3 : 0)) {
    const NextEvent<D>& a = next_events_[later->slot];
    prefetch_candidates(a);
    if (meets(a)) lists_->prefetch(next_events_[packing_.slot(a.partner)]);
  }
  if (!large_) return;
  if (const CalendarEntry* const next = calendar_.upcoming(1))
    if (const NextEvent<D>& a = next_events_[next->slot]; meets(a))
      prefetch_candidates(next_events_[packing_.slot(a.partner)]);
}

/// A core in the cache: only what takes longest.
template <int D>
void EventCore<D>::prefetch_few_cells() const {
  if (const CalendarEntry* const later = calendar_.upcoming(3)) prefetch(later->slot);
  if (const CalendarEntry* const next = calendar_.upcoming(1))
    cells_->prefetch(next_events_[next->slot].where.cell, 0, 0);
}

/// A core that is larger: to look at the cells twice costs less than to wait for the spheres in them.
template <int D>
void EventCore<D>::prefetch_cells() {
  const auto fetch = [&](Slot j) { prefetch_line(&flights_[j]); };
  const auto step = [](const NextEvent<D>& a) { return a.contact <= a.update ? 0 : a.face % 2 == 1 ? 1 : -1; };
  if (const CalendarEntry* const later = calendar_.upcoming(8)) {
    prefetch(later->slot);
    cells_->prefetch(later->slot);
  }
  if (const CalendarEntry* const later = calendar_.upcoming(5)) {
    const NextEvent<D>& a = next_events_[later->slot];
    cells_->prefetch(a.where.cell, a.face / 2, step(a));
    if (meets(a)) prefetch(packing_.slot(a.partner));
  }
  if (const CalendarEntry* const later = calendar_.upcoming(3)) {
    const NextEvent<D>& a = next_events_[later->slot];
    cells_->prefetch_spheres(a.where.cell, a.face / 2, step(a), found_, fetch);
    if (meets(a)) cells_->prefetch(next_events_[packing_.slot(a.partner)].where.cell, 0, 0);
  }
  if (const CalendarEntry* const next = calendar_.upcoming(1))
    if (const NextEvent<D>& a = next_events_[next->slot]; meets(a))
      cells_->prefetch_spheres(next_events_[packing_.slot(a.partner)].where.cell, 0, 0, found_, fetch);
}

template void EventCore<2>::prefetch_upcoming();
template void EventCore<3>::prefetch_upcoming();

}  // namespace carom
