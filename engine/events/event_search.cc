// SPDX-License-Identifier: BSD-3-Clause
#include "engine/events/event_search.h"

#include <bit>

namespace carom {

template <int D>
void EventSearch<D>::clear() {
  lists_.reset();
  larges_.reset();
  cells_.reset();
}

template <int D>
void EventSearch<D>::start(double now, double max_displacement) {
  max_displacement_ = max_displacement;
  setting_ = flights_.setting();
  std::vector<double> reaches = flights_.reaches(flights_.horizon());
  if (lists_ && reaches_ == reaches && !box_.sheared()) {  // lists are reused if the reaches are unchanged
    lists_->follow(flights_.records());
  } else {
    clear();
    queue_.clear();
    reaches_ = std::move(reaches);
    choose(now);
  }
  for (Slot i = 0; i < flights_.size(); ++i) {
    foresee(i, now);
    queue_.read_versions();
  }
  queue_.fill(now, flights_.horizon(), options_.entries_per_bin);
}

template <int D>
void EventSearch<D>::choose(double now) {
  small_ = 8 * static_cast<double>(flights_.capacity()) <= options_.in_cache;
  large_ = static_cast<double>(flights_.capacity()) > options_.in_cache;
  at_border_.clear();
  // The density is that of the whole system: a subdomain has a part of it, perhaps no spheres yet, and may receive
  // larger ones.
  const std::vector<double>& radii = flights_.size() == 0 && sizes_ ? sizes_->radius : reaches_;
  if (box_.sheared()) options_.method = SearchOptions::Method::lists;  // cells would slide
  if (counts_.predictions == 0) tuning_ = SearchTuning(options_);
  Extent<D> extent = flights_.extent();
  if (sizes_) {
    largest_ = box_.steps.reach()(sizes_->largest_radius());
    extent.particles = sizes_->spheres;
  } else {
    largest_ = *std::max_element(radii.begin(), radii.end());
  }
  SearchSituation situation = situation_of<D>(box_, radii, extent);
  situation.largest = 2 * largest_;
  if (!flights_.equal() && !box_.sheared()) situation.classes = size_classes();
  tuning_.choose(situation, counts_);
  if (!tuning_.lists()) {
    cells_ =
        std::make_unique<LinkedCells<D>>(box_, flights_.packing(), kernels_, tuning_.cell(), extent, flights_.size());
    if (flights_.size() < extent.particles) cells_->confine(flights_.places(now));
    if (tuning_.small() < kNever && !flights_.equal())
      larges_ = std::make_unique<LargeSpheres<D>>(*cells_, flights_.packing(), reaches_, tuning_.small(),
                                                  tuning_.skin(), queue_.plans());
    for (Slot i = 0; i < flights_.size(); ++i) {
      if (larges_ && larges_->has(i)) continue;
      queue_[i].where.cell = cells_->place(flights_.at(i, now).x);
      cells_->insert(i, queue_[i].where.cell);
    }
    for (Slot i = 0; larges_ && i < flights_.size(); ++i)
      if (larges_->has(i)) larges_->renew(i, flights_.at(i, now).x);
    return;
  }
  double skin = tuning_.skin();
  for (int k = 0; k < D; ++k)
    if (box_.periodic(k)) skin = std::min(skin, 0.2 * box_.edges[k]);  // below half a box: images stay distinct
  const auto flow = FlowFrame::between(box_.shear_rate, now, flights_.horizon());
  Box<D> box = box_;
  box.tilt += box_.slide() * flow.time;  // not made shorter: images keep their numbers
  lists_ = std::make_unique<SkinLists<D>>(box, flow, flights_.packing(), kernels_, reaches_, flights_.equal(), largest_,
                                          skin, queue_.plans());
  // In a window of a subdomain spheres also move relative to the centre of a region that is elsewhere in the flow.
  if (box_.sheared() && max_displacement_ > 0) max_displacement_ += kStrainOfWindow * (skin + max_displacement_);
  lists_->build(
      flights_.size(), [&](Slot i) { return place(i, now); }, extent, max_displacement_);
}

/// The spheres of the whole system in octaves of reach. A subdomain takes thermal speeds, because it may have no sphere
/// of some size.
template <int D>
std::vector<SearchSituation::SizeClass> EventSearch<D>::size_classes() const {
  std::vector<SearchSituation::SizeClass> classes(SkinLists<D>::kOctaves);
  const auto add = [&](double reach, double number, double speed_squared) {
    if (number == 0) return;
    SearchSituation::SizeClass& of = classes[SkinLists<D>::octave(largest_, reach)];
    of.number += number;
    of.mean += (2 * reach - of.mean) * number / of.number;
    of.largest = std::max(of.largest, 2 * reach);
    of.speed_squared += (speed_squared - of.speed_squared) * number / of.number;
  };
  for (std::size_t k = 0; sizes_ && k < sizes_->radius.size(); ++k)
    add(box_.steps.reach()(sizes_->radius[k]), sizes_->number.empty() ? 1 : sizes_->number[k], 1 / sizes_->mass[k]);
  for (Slot i = 0; !sizes_ && i < flights_.size(); ++i) add(reaches_[i], 1, flights_[i].v.squaredNorm());
  return classes;
}

/// The list of a sphere as input of the kernels.
template <int D>
ScanTask EventSearch<D>::listed(Slot i) const {
  const NextEvent<D>& a = queue_[i];
  return {i, lists_->candidates(a), a.count, a.same};
}

template <int D>
void EventSearch<D>::plan(Slot i, double now) {
  foresee(i, now);
  queue_.schedule(i);
}

template <int D>
void EventSearch<D>::foresee(Slot i, double now) {
  if (cells_) return foresee_in_cells(i, now);
  ++counts_.predictions;
  queue_[i].contact = kNever;
  scan(listed(i), flights_[i].t == now);
  if (flights_.has_lone_events()) foresee_lone_events(i);
  foresee_leaving(i, now);
}

template <int D>
void EventSearch<D>::foresee_in_cells(Slot i, double now) {
  ++counts_.predictions;
  NextEvent<D>& a = queue_[i];
  a.contact = kNever;
  if (larges_ && larges_->has(i)) return foresee_large(i, now);
  const ScanResult first = cells_->scan_around(setting_, i, a.where.cell, flights_[i].t == now, found_);
  plan_found(i, first, found_);
  if (larges_) scan_beside(larges_->around(i, a.where.cell), flights_[i].t == now);
  if (flights_.has_lone_events()) foresee_lone_events(i);
  predict_crossing(a, i, flights_, box_, *cells_, now);
}

/// foresee_in_cells() for a sphere that is not in the cells.
template <int D>
void EventSearch<D>::foresee_large(Slot i, double now) {
  scan_beside(larges_->around(i), flights_[i].t == now);
  if (flights_.has_lone_events()) foresee_lone_events(i);
  foresee_update(i, now);
}

/// Makes a new region for a large sphere that is about to leave the one it has.
template <int D>
void EventSearch<D>::renew_region(Slot i, double now) {
  ++counts_.rebuilds;
  larges_->renew(i, flights_.at(i, now).x);
  scan_beside(larges_->around(i), false);
  foresee_update(i, now);
  queue_.schedule(i);
}

/// Both spheres are scanned before anything depends on what was found, so that the processor overlaps the scans.
template <int D>
void EventSearch<D>::plan_two_in_cells(Slot i, Slot j, double now) {
  counts_.predictions += 2;
  NextEvent<D>&a = queue_[i], &b = queue_[j];
  const ScanResult first = cells_->scan_around(setting_, i, a.where.cell, true, found_);
  const ScanResult second = cells_->scan_around(setting_, j, b.where.cell, true, others_);
  predict_crossing(a, i, flights_, box_, *cells_, now);
  predict_crossing(b, j, flights_, box_, *cells_, now);
  a.contact = b.contact = kNever;
  plan_found(i, first, found_);
  plan_found(j, second, others_);
  for (const Slot one : {i, j}) {
    if (flights_.has_lone_events()) foresee_lone_events(one);
    queue_.schedule(one);
  }
}

template <int D>
void EventSearch<D>::plan_two(Slot i, Slot j, double now) {
  if (cells_) {
    if (!larges_) return plan_two_in_cells(i, j, now);
    for (const Slot one : {i, j}) plan(one, now);
    return;
  }
  counts_.predictions += 2;
  const ScanTask task[2] = {listed(i), listed(j)};
  counts_.candidates += task[0].n + task[1].n;
  ScanResult first[2];
  if (!flights_.has_steps()) kernels_.scan_two[D - 2](setting_, task, first);
  queue_[i].contact = queue_[j].contact = kNever;
  for (const int k : {0, 1}) {
    const Slot one = task[k].self;
    plan_first(task[k], first[k]);
    if (flights_.has_lone_events()) foresee_lone_events(one);
    foresee_leaving(one, now);
    queue_.schedule(one);
  }
}

/// Plans the first contact with the candidates if it is earlier than the planned one. `latest`: no record is later than
/// the sphere's.
template <int D>
void EventSearch<D>::scan(const ScanTask& task, bool latest) {
  counts_.candidates += task.n;
  plan_first(task, flights_.has_steps() ? ScanResult{} : kernels_.scan[D - 2](setting_, task, latest));
}

template <int D>
void EventSearch<D>::scan_beside(const ScanTask& task, bool latest) {
  if (task.n > 0) scan(task, latest);
}

/// Plans the first contact with the candidates, or the first step that a pair reaches, if it is earlier than the
/// planned one.
template <int D>
void EventSearch<D>::offer_steps(const ScanTask& task) {
  if (!setting_.surfaces) return offer_all(task);
  for (unsigned start = 0; start < task.n; start += kScanBlock) {
    const unsigned n = std::min(task.n - start, kScanBlock);
    const ScanTask block{task.self, task.candidates + start, n, std::min(task.same - std::min(task.same, start), n)};
    const StepScan found = kernels_.scan_steps[D - 2](setting_, block);
    for (std::uint64_t near = found.near; near != 0; near &= near - 1)
      offer(block, static_cast<unsigned>(std::countr_zero(near)));
    const auto& [time, which, tied] = found.first;
    if (time == kNever) continue;
    if (tied) [[unlikely]]
      offer_all(block);
    else
      queue_.offer(task.self, time, EventKind::pair, block.candidates[which]);
  }
}

/// Plans the contact with a candidate if it is earlier than the planned one.
template <int D>
void EventSearch<D>::offer(const ScanTask& task, unsigned q) {
  const std::uint32_t candidate = task.candidates[q];
  const Slot j = flights_.packing().slot(candidate);
  if (j == task.self) return;
  const double time = flights_.pair_contact(task.self, j, box_.offset(flights_.packing().image(candidate)));
  if (time <= queue_[task.self].contact && time < kNever) queue_.offer(task.self, time, EventKind::pair, candidate);
}

/// Plans the first contact with the candidates, computed one by one.
template <int D>
void EventSearch<D>::offer_all(const ScanTask& task) {
  for (unsigned q = 0; q < task.n; ++q) offer(task, q);
}

template <int D>
void EventSearch<D>::foresee_lone_events(Slot i) {
  flights_.visit_lone_events(i, flights_[i],
                             [&](double time, EventKind kind, Id number) { queue_.offer(i, time, kind, number); });
}

template <int D>
void EventSearch<D>::foresee_update(Slot i, double now) {
  if (lists_)
    foresee_leaving(i, now);
  else if (larges_ && larges_->has(i))
    predict_leaving(queue_[i], flights_[i], flights_, FlowFrame(), larges_->skin(), now);
  else
    predict_crossing(queue_[i], i, flights_, box_, *cells_, now);
}

template <int D>
void EventSearch<D>::look_again(Slot i, double now) {
  if (larges_) [[unlikely]]
    look_again_beside(i, now);
  else if (cells_)
    cross(i, now);
  else
    renew_list(i, now);
}

/// look_again() where there are large spheres beside the cells.
template <int D>
void EventSearch<D>::look_again_beside(Slot i, double now) {
  if (larges_->has(i)) return renew_region(i, now);
  const CellPlace<D>& place = queue_[i].where.cell;
  const CellPlace<D> before = place;
  cross(i, now);
  if (!larges_->parts(before, place)) return;
  scan_beside(larges_->pass(i, before, place), false);
  queue_.schedule(i);
}

/// Renews the list of a sphere that is about to leave its region.
template <int D>
void EventSearch<D>::renew_list(Slot i, double now) {
  const NextEvent<D>& a = queue_[i];
  const auto way = [&](const Vec<D>& x) {  // distance from the centre of its list's region
    return (x - Eigen::Map<const Vec<D>>(a.where.centre)).norm();
  };
  if (const Vec<D> x = place(i, now); !flights_.field() || way(x) >= 0.7 * distance_left(i)) {
    ++counts_.rebuilds;
    if (box_.sheared()) lists_->pass(now, max_displacement_ > 0 ? kStrainOfWindow : 0);
    const std::span<const std::uint32_t> fresh = lists_->renew(i, x);
    if (!fresh.empty()) scan({i, fresh.data(), static_cast<unsigned>(fresh.size()), 0}, false);
  }  // else its list is still valid far enough
  foresee_update(i, now);
  queue_.schedule(i);
}

/// Moves a sphere into the next cell and looks at the cells ahead.
template <int D>
void EventSearch<D>::cross(Slot i, double now) {
  ++counts_.crossings;
  NextEvent<D>& a = queue_[i];
  cells_->cross(i, a.where.cell, a.face / 2, a.face % 2 == 1 ? 1 : -1);
  const ScanResult first = cells_->scan_ahead(setting_, i, a.where.cell, a.face, found_);
  predict_crossing(a, i, flights_, box_, *cells_, now);
  plan_found(i, first, found_);
  queue_.schedule(i);
}

template <int D>
void EventSearch<D>::admit(Slot i, double reach, double now) {
  if (!flights_.equal()) {
    reaches_.resize(std::max<std::size_t>(reaches_.size(), i + 1));
    reaches_[i] = reach;
  }
  setting_ = flights_.setting();
  if (!at_border_.empty()) at_border_[i] = border_fits() ? 1 : 0;
  if (larges_) larges_->admit(i, reaches_);
  if (lists_)
    lists_->admit(i, place(i, now), reaches_);
  else if (larges_ && larges_->has(i))
    larges_->renew(i, flights_.at(i, now).x);
  else
    enter_cell(i, now);
  plan(i, now);
}

template <int D>
void EventSearch<D>::dismiss(Slot i) {
  if (lists_)
    lists_->dismiss(i);
  else if (larges_ && larges_->has(i))
    larges_->dismiss(i);
  else
    leave_cell(i);
}

template <int D>
void EventSearch<D>::enter_cell(Slot i, double now) {
  CellPlace<D>& cell = queue_[i].where.cell;
  cell = cells_->place(flights_.at(i, now).x);
  cells_->admit(i, cell);
  if (larges_) larges_->enter(i, cell);
}

template <int D>
void EventSearch<D>::leave_cell(Slot i) {
  const CellPlace<D>& cell = queue_[i].where.cell;
  if (larges_) larges_->leave(i, cell);
  cells_->remove(i, cell);
}

template <int D>
void EventSearch<D>::move(Slot i, double now) {
  if (lists_) {
    lists_->move(i, place(i, now), distance_left(i), now);
  } else if (larges_ && larges_->has(i)) {
    const Vec<D> x = flights_.at(i, now).x;
    if (!((x - larges_->centre(i)).norm() < larges_->skin() * (1 - 1e-6))) larges_->renew(i, x);
  } else {
    leave_cell(i);
    enter_cell(i, now);
  }
}

template <int D>
void EventSearch<D>::set_border(std::span<const Slot> slots, double now) {
  const auto before = std::exchange(at_border_, std::vector<std::uint8_t>(flights_.capacity()));
  if (!border_fits()) return;
  for (const Slot i : slots) {
    at_border_[i] = 1;
    if (!before.empty() && before[i] != 0) continue;  // it has stayed near the centre of its region
    if (lists_->move(i, place(i, now), distance_left(i), now)) {
      plan(i, now);
      queue_.read_versions();
    } else {
      foresee_update(i, now);
      queue_.schedule(i);
    }
  }
}

template <int D>
std::span<const std::uint32_t> EventSearch<D>::find_near(Slot i) {
  if (lists_) return lists_->find_near(i, max_displacement_);
  const CellGrid<D>& grid = cells_->grid();
  if (larges_ && larges_->has(i)) {
    const Vec<D> x = larges_->centre(i), room = Vec<D>::Constant(larges_->range(i) + 2 * max_displacement_);
    return find_between(grid.cell(x - room), grid.cell(x + room));
  }
  const double reach = larges_ ? std::max(tuning_.small(), 0.0) : largest_;
  Cell<D> low, high;
  for (int k = 0; k < D; ++k) {
    const auto range = static_cast<std::int32_t>(std::ceil(2 * (reach + max_displacement_) / grid.edge(k)));
    low[k] = queue_[i].where.cell.unwrapped[k] - range;
    high[k] = queue_[i].where.cell.unwrapped[k] + range;
  }
  return find_between(low, high);
}

/// All spheres in the cells between two, and the large ones that they may touch.
template <int D>
std::span<const std::uint32_t> EventSearch<D>::find_between(const Cell<D>& low, const Cell<D>& high) {
  cells_->find_between(low, high, near_);
  if (larges_) larges_->find_between(low, high, near_);
  return near_;
}

template <int D>
std::span<const std::uint32_t> EventSearch<D>::find_near_at_border(Slot i, const Vec<D>& low, const Vec<D>& high,
                                                                   const Vec<D>& x, double way) {
  if (cells_) {
    const CellGrid<D>& grid = cells_->grid();
    if (!larges_ || larges_->has(i)) return find_between(grid.cell(low), grid.cell(high));
    // The large spheres that a small one may touch are on the lists of the blocks in which it may be.
    const Vec<D> room = Vec<D>::Constant(2 * (tuning_.small() + max_displacement_) + way);
    cells_->find_between(grid.cell(low.cwiseMax(x - room)), grid.cell(high.cwiseMin(x + room)), near_);
    larges_->find_between(grid.cell(x - room), grid.cell(x + room), near_);
    return near_;
  }
  if (distance_left(i) == lists_->skin()) return find_near(i);
  return {lists_->candidates(queue_[i]), queue_[i].count};
}

template class EventSearch<2>;
template class EventSearch<3>;

}  // namespace carom
