// SPDX-License-Identifier: BSD-3-Clause
#include "engine/events/event_prefetch.h"

namespace carom {
namespace {

template <int D>
bool meets(const NextEvent<D>& a) {
  return a.contact < a.update && a.kind == EventKind::pair;
}

/// Pointers into the core, held in registers.
template <int D>
struct View {
  const NextEvent<D>* plans;
  const Record<D>* records;
  std::uint32_t slot_mask;

  View(const EventQueue<D>& queue, const Flights<D>& flights)
      : plans(&queue[0]), records(&flights[0]), slot_mask(flights.packing().slot_mask) {}
  Slot slot(std::uint32_t candidate) const { return candidate & slot_mask; }
  Slot partner(const NextEvent<D>& a) const { return slot(a.partner); }
  void fetch(Slot i) const { prefetch_line(&records[i]); }
  void fetch_sphere(Slot i) const {
    prefetch_line(&plans[i]);
    fetch(i);
  }
};

}  // namespace

template <int D>
void prefetch_upcoming(const EventQueue<D>& queue, const Flights<D>& flights, const SkinLists<D>& lists, bool large) {
  const View<D> view(queue, flights);
  const auto fetch_candidates = [&](const NextEvent<D>& a) {
    const std::uint32_t* const list = lists.candidates(a);
    for (unsigned q = 0; q < a.count; ++q) view.fetch(view.slot(list[q]));
  };
  if (const CalendarEntry* const later = queue.upcoming(large ? 8 : 3)) view.fetch_sphere(later->slot);
  if (const CalendarEntry* const later = queue.upcoming(large ? 5 : 1)) {
    const NextEvent<D>& a = view.plans[later->slot];
    lists.prefetch(a);
    if (meets(a)) view.fetch_sphere(view.partner(a));
  }
  if (const CalendarEntry* const later = queue.upcoming(large ? 3 : 0)) {
    const NextEvent<D>& a = view.plans[later->slot];
    fetch_candidates(a);
    if (meets(a)) lists.prefetch(view.plans[view.partner(a)]);
  }
  if (!large) return;
  if (const CalendarEntry* const next = queue.upcoming(1))
    if (const NextEvent<D>& a = view.plans[next->slot]; meets(a)) fetch_candidates(view.plans[view.partner(a)]);
}

template <int D>
void prefetch_upcoming(const EventQueue<D>& queue, const Flights<D>& flights, const LinkedCells<D>& cells,
                       const LargeSpheres<D>* larges, Candidates& found, bool large) {
  const View<D> view(queue, flights);
  const auto in_cell = [&](Slot i) { return !larges || !larges->has(i); };
  if (!large) {
    if (const CalendarEntry* const later = queue.upcoming(3)) view.fetch_sphere(later->slot);
    if (const CalendarEntry* const next = queue.upcoming(1); next && in_cell(next->slot))
      cells.prefetch(view.plans[next->slot].where.cell, 0, 0, found);
    return;
  }
  // Reading the cells twice is cheaper than waiting for the spheres in them.
  const auto fetch = [&](Slot j) { view.fetch(j); };
  const auto step = [](const NextEvent<D>& a) { return a.contact <= a.update ? 0 : a.face % 2 == 1 ? 1 : -1; };
  if (const CalendarEntry* const later = queue.upcoming(8)) {
    view.fetch_sphere(later->slot);
    if (in_cell(later->slot)) cells.prefetch(later->slot);
  }
  if (const CalendarEntry* const later = queue.upcoming(5)) {
    const NextEvent<D>& a = view.plans[later->slot];
    if (in_cell(later->slot)) cells.prefetch(a.where.cell, a.face / 2, step(a), found);
    if (meets(a)) view.fetch_sphere(view.partner(a));
  }
  if (const CalendarEntry* const later = queue.upcoming(3)) {
    const NextEvent<D>& a = view.plans[later->slot];
    if (in_cell(later->slot)) cells.prefetch_spheres(a.where.cell, a.face / 2, step(a), found, fetch);
    if (meets(a) && in_cell(view.partner(a))) cells.prefetch(view.plans[view.partner(a)].where.cell, 0, 0, found);
  }
  if (const CalendarEntry* const next = queue.upcoming(1))
    if (const NextEvent<D>& a = view.plans[next->slot]; meets(a) && in_cell(view.partner(a)))
      cells.prefetch_spheres(view.plans[view.partner(a)].where.cell, 0, 0, found, fetch);
}

template void prefetch_upcoming(const EventQueue<2>&, const Flights<2>&, const SkinLists<2>&, bool);
template void prefetch_upcoming(const EventQueue<3>&, const Flights<3>&, const SkinLists<3>&, bool);
template void prefetch_upcoming(const EventQueue<2>&, const Flights<2>&, const LinkedCells<2>&, const LargeSpheres<2>*,
                                Candidates&, bool);
template void prefetch_upcoming(const EventQueue<3>&, const Flights<3>&, const LinkedCells<3>&, const LargeSpheres<3>*,
                                Candidates&, bool);

}  // namespace carom
