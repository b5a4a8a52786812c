// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Free flight of a system divided among ranks, one subdomain each, with the bits of a single core.
//
// Time is divided into windows (engine/ranks/subdomain.h). In a window no sphere may move farther than
// `max_displacement` from its start, so a subdomain needs only the spheres that start within a diameter plus twice
// `max_displacement` of it. If a sphere is so fast that it may have moved farther, the window is run again in shorter
// ones. A sphere belongs to the subdomain that contains it at the start of the window; all subdomains that
// have it compute the same owner.
//
//   WindowedFlight<3> flight(box, particles, ranks);
//   flight.take(particles, g, horizon);
//   flight.run(end, report);
//   flight.give_back(end, particles);
//
// All functions are collective. No rank has all particles: between epochs it has a block of them (id_blocks.h), in an
// epoch the spheres and ghosts of its subdomain. If there are too few particles for all ranks, or the box is too small
// for so many subdomains, the last ranks have none.

#include <optional>

#include "engine/ranks/id_blocks.h"
#include "engine/ranks/subdomain.h"
#include "engine/ranks/window_length.h"

namespace carom {

template <int D>
class WindowedFlight {
 public:
  using Report = typename EventCore<D>::Report;

  /// `window` sets the length of windows [time].
  WindowedFlight(const Box<D>& box, Sizes sizes, Communicator& ranks, const SearchOptions& options = {},
                 std::function<double()> window = {});

  /// Functions as in EventCore. `particles` is this rank's block; contacts are reported on rank 0. After a run that the
  /// collision limit has ended, only copy_at() and give_back() may follow.
  void take(Particles<D>& particles, const Vec<D>& g, double horizon);
  double run(double end, const Report& report);
  void copy_at(double time, Particles<D>& copies);
  void give_back(double time, Particles<D>& particles);
  double now() const { return now_; }

  /// On this rank, since construction.
  EventCounts counts() const { return subdomain_.event_counts(); }
  const WindowCounts& window_counts() const { return subdomain_.counts; }

 private:
  bool has_internal() const { return box_.contacts.need_internal(); }
  IdBlocks blocks() const { return {sizes_.spheres, static_cast<std::size_t>(ranks_.size())}; }
  void measure_work();
  void reload();
  template <class Spheres>
  std::vector<Bytes> messages(Spheres&& spheres);
  void load(double now, std::vector<Bytes> spheres);
  EventKey<D> key_of_contact(std::uint64_t number, bool pairs);
  /// What a rank knows after a round of a window, and what all ranks know together.
  struct Vote {
    bool changed = false;                 ///< a path has changed since the last vote
    bool no_room = false;                 ///< there was no room for a ghost
    double reached = 0;                   ///< the time at which the log was full, or the end of the window
    double speed = 0;                     ///< the largest one of a sphere
    std::uint64_t collisions_before = 0;  ///< number of pair collisions in the window before
    std::uint64_t events_before = 0;      ///< number of contacts in the window before
    std::uint64_t most_collisions = 0;    ///< an upper limit of the collisions in this window
  };
  Vote vote_of_all(const Vote& mine);

  const Box<D>& box_;
  Sizes sizes_;
  Communicator& ranks_;
  std::size_t subdomains_;
  std::optional<Bisection<D>> bisection_;
  Subdomain<D> subdomain_;  // this rank's
  WindowLength<D> length_;
  Vec<D> g_ = Vec<D>::Zero();
  double horizon_ = 0, now_ = 0;
  std::uint64_t events_ = 0;  // contacts since take()
  // Events per sphere of the subdomain in the epoch, relative to a mean of kMeanWork over all subdomains; and the same
  // value for each sphere of this rank's block.
  std::uint32_t subdomain_work_ = 0;
  std::vector<std::uint32_t> work_;
  std::uint64_t run_before_ = 0;  // events of first runs before the epoch
};

}  // namespace carom
