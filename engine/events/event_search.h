// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Plans the next event of a sphere: its first contact with the spheres near it, and until when no others are near.
//
// Those near a sphere stand in neighbour lists, or in cells where the system is dilute; neither changes a contact. So
// nothing that happens here can reach the physics.

#include <memory>

#include "engine/base/event_counts.h"
#include "engine/base/sizes.h"
#include "engine/events/event_prefetch.h"
#include "engine/search/search_tuning.h"

namespace carom {

template <int D>
class EventSearch {
 public:
  /// Plans go into `queue`. `sizes` as in EventCore. All outlive the search.
  EventSearch(const Box<D>& box, const Flights<D>& flights, EventQueue<D>& queue, const Sizes* sizes,
              const SearchOptions& options)
      : box_(box),
        flights_(flights),
        queue_(queue),
        sizes_(sizes),
        options_(options),
        kernels_(widest_kernels<ScanKernels>()),
        tuning_(options) {}

  /// Slots are about to change: forgets which spheres are near which.
  void clear();
  /// Plans the first event of every sphere, and fills the queue. No record is of a later time than `now`; find_near()
  /// will use `max_displacement`.
  void start(double now, double max_displacement);

  /// After a change of a sphere's record, or its partner's: plans its next event.
  void plan(Slot i, double now);
  /// The same for two spheres that have just collided.
  void plan_two(Slot i, Slot j, double now);
  /// NextEvent::update has come: looks at a sphere's surroundings again. The planned contact stands, but for others
  /// that come before it.
  void look_again(Slot i, double now);

  /// Takes in a sphere that flights and queue have.
  void admit(Slot i, double radius, double now);
  void dismiss(Slot i);
  /// The record of a sphere has been replaced.
  void move(Slot i, double now);
  /// As in EventCore.
  void set_border(std::span<const Slot> slots, double now);
  std::span<const std::uint32_t> find_near(Slot i);
  std::span<const std::uint32_t> find_near_at_border(Slot i, const Vec<D>& low, const Vec<D>& high);

  /// Starts to fetch what the next events will need.
  void prefetch() {
    if (small_) return;
    if (lists_)
      prefetch_upcoming(queue_, flights_, *lists_, large_);
    else if (large_)
      prefetch_upcoming(queue_, flights_, *cells_, found_);
    else
      prefetch_upcoming(queue_, flights_, *cells_);
  }

  const EventCounts& counts() const { return counts_; }

 private:
  void choose(double now);
  void foresee(Slot i, double now);
  [[gnu::noinline]] void foresee_walls(Slot i);
  void foresee_update(Slot i, double now);
  ScanTask around(Slot i, Candidates& found);
  void scan(const ScanTask& task, bool latest);
  void plan_first(const ScanTask& task, const ScanResult& first);
  [[gnu::noinline]] void offer_all(const ScanTask& task);  // seldom needed, and large
  double distance_left(Slot i) const;
  /// Whether lists have room for another `max_displacement` at the border.
  bool border_fits() const { return lists_ && lists_->skin() >= 3 * max_displacement_; }

  const Box<D>& box_;
  const Flights<D>& flights_;
  EventQueue<D>& queue_;
  const Sizes* sizes_;
  SearchOptions options_;
  const ScanKernels& kernels_;
  SearchTuning tuning_;
  ScanSetting setting_;

  std::unique_ptr<SkinLists<D>> lists_;  // one of the two
  std::unique_ptr<LinkedCells<D>> cells_;
  Candidates found_, others_;
  std::vector<std::uint32_t> near_;
  std::vector<double> radii_;                  // that lists or cells are made for; one where all are equal
  double max_displacement_ = 0, largest_ = 0;  // how far spheres may be from where the core has them; largest radius
  std::vector<std::uint8_t> at_border_;        // by slot; empty: no sphere is
  bool small_ = true, large_ = false;          // few enough for a fast cache; too many for any
  EventCounts counts_;
};

}  // namespace carom
