// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Plans the next event of a sphere: its first contact with nearby spheres, and the time until which its neighbourhood
// is valid.
//
// Nearby spheres come from neighbour lists, or from cells if the system is dilute. Neither changes a contact, so the
// search cannot affect the results.

#include <memory>

#include "engine/base/event_counts.h"
#include "engine/base/sizes.h"
#include "engine/events/contact.h"
#include "engine/events/event_prefetch.h"
#include "engine/events/surroundings.h"
#include "engine/search/large_spheres.h"
#include "engine/search/search_tuning.h"

namespace carom {

template <int D>
class EventSearch {
 public:
  /// Stores plans in `queue`. `sizes` as in EventCore. All arguments must outlive the search.
  EventSearch(const Box<D>& box, const Flights<D>& flights, EventQueue<D>& queue, const Sizes* sizes,
              const SearchOptions& options)
      : box_(box),
        flights_(flights),
        queue_(queue),
        sizes_(sizes),
        options_(options),
        kernels_(widest_kernels<ScanKernels>()),
        tuning_(options) {}

  /// Discards lists and cells; call it before slots change.
  void clear();
  /// Plans the first event of every sphere and fills the queue. No record may be later than `now`; find_near() uses
  /// `max_displacement`.
  void start(double now, double max_displacement);

  /// Plans the next event of a sphere after its record, or its partner's, has changed.
  void plan(Slot i, double now);
  /// plan() for two spheres that have just collided.
  void plan_two(Slot i, Slot j, double now);
  /// Updates a sphere's neighbourhood when NextEvent::update is due. Its planned contact stays unless an earlier one is
  /// found.
  void look_again(Slot i, double now);

  /// Adds a sphere that flights and queue already have.
  void admit(Slot i, double reach, double now);
  void dismiss(Slot i);
  /// Updates the search after the record of a sphere has been replaced.
  void move(Slot i, double now);
  /// As in EventCore.
  void set_border(std::span<const Slot> slots, double now);
  std::span<const std::uint32_t> find_near(Slot i);
  std::span<const std::uint32_t> find_near_at_border(Slot i, const Vec<D>& low, const Vec<D>& high, const Vec<D>& x,
                                                     double way);

  /// Starts to prefetch the data of the next events.
  void prefetch() {
    if (small_) return;
    if (lists_)
      prefetch_upcoming(queue_, flights_, *lists_, large_);
    else
      prefetch_upcoming(queue_, flights_, *cells_, larges_.get(), found_, large_);
  }

  const EventCounts& counts() const { return counts_; }

 private:
  void choose(double now);
  std::vector<SearchSituation::SizeClass> size_classes() const;
  void foresee(Slot i, double now);
  [[gnu::noinline]] void foresee_in_cells(Slot i, double now);
  [[gnu::noinline]] void foresee_large(Slot i, double now);
  [[gnu::noinline]] void renew_region(Slot i, double now);
  [[gnu::noinline]] void plan_two_in_cells(Slot i, Slot j, double now);
  [[gnu::noinline]] void foresee_lone_events(Slot i);
  void foresee_update(Slot i, double now);
  void look_again_beside(Slot i, double now);
  void enter_cell(Slot i, double now);
  void leave_cell(Slot i);
  std::span<const std::uint32_t> find_between(const Cell<D>& low, const Cell<D>& high);
  /// foresee_update() with lists.
  [[gnu::always_inline]] void foresee_leaving(Slot i, double now) {
    predict_leaving(queue_[i], flights_[i], flights_, lists_->flow(), distance_left(i), now);
  }
  ScanTask listed(Slot i) const;
  void scan(const ScanTask& task, bool latest);
  /// scan() where spheres are large; the compiler would otherwise not inline scan() elsewhere.
  [[gnu::noinline]] void scan_beside(const ScanTask& task, bool latest);
  /// Plans the first contact with the candidates if it is earlier than the planned one.
  [[gnu::always_inline]] void plan_first(const ScanTask& task, const ScanResult& first) {
    if (flights_.has_steps()) [[unlikely]]
      return offer_steps(task);
    const double planned = queue_[task.self].contact;
    if (first.time > planned || first.time == kNever) return;
    if (first.tied || first.time == planned || first.time == -kNever) [[unlikely]]
      return offer_all(task);
    queue_.plan_pair(task.self, first.time, task.candidates[first.which]);
  }
  [[gnu::always_inline]] void plan_found(Slot i, const ScanResult& first, const Candidates& found) {
    counts_.candidates += found.task.count;
    plan_first({i, found.task.candidates, found.task.count, found.task.same}, first);
  }
  [[gnu::noinline]] void offer_steps(const ScanTask& task);
  void offer(const ScanTask& task, unsigned q);
  [[gnu::noinline]] void offer_all(const ScanTask& task);  // seldom needed, and large
  [[gnu::noinline]] void cross(Slot i, double now);
  [[gnu::noinline]] void renew_list(Slot i, double now);
  /// The distance that a sphere may be from the centre of its list's region.
  double distance_left(Slot i) const {
    return lists_->skin() - (!at_border_.empty() && at_border_[i] != 0 ? max_displacement_ : 0);
  }
  /// The place of a sphere as the lists take it.
  Vec<D> place(Slot i, double now) const {
    const Vec<D> x = flights_.at(i, now).x;
    return lists_->flow().coordinates(x, now);
  }
  /// Whether the skin leaves room for another `max_displacement` at the border.
  bool border_fits() const { return lists_ && lists_->skin() >= 3 * max_displacement_; }

  const Box<D>& box_;
  const Flights<D>& flights_;
  EventQueue<D>& queue_;
  const Sizes* sizes_;
  SearchOptions options_;
  const ScanKernels& kernels_;
  SearchTuning tuning_;
  ScanSetting setting_;

  std::unique_ptr<SkinLists<D>> lists_;  // lists_ or cells_ is set
  std::unique_ptr<LinkedCells<D>> cells_;
  std::unique_ptr<LargeSpheres<D>> larges_;  // if the cells hold small spheres only
  Candidates found_, others_;
  std::vector<std::uint32_t> near_;
  std::vector<double> reaches_;                // for which lists or cells were made; one value if all are equal
  double max_displacement_ = 0, largest_ = 0;  // bound on displacements (load); largest reach
  std::vector<std::uint8_t> at_border_;        // by slot; empty if there is no border
  bool small_ = true, large_ = false;          // fits into a fast cache; fits into no cache
  EventCounts counts_;
};

}  // namespace carom
