// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Free flight of a system divided among ranks, a subdomain each, with the bits of one core.
//
// Time goes in windows (engine/ranks/subdomain.h). In each no sphere may come farther than `max_displacement` from
// where it was at its start, so that a subdomain needs to know those only that start within a diameter and twice
// `max_displacement` of it; where a sphere is faster than expected the window is cut to the time at which it would have
// mattered. A sphere belongs to the subdomain that it is in at a window's start, which all subdomains that have it
// compute alike.
//
//   WindowedFlight<3> flight(box, particles, ranks);
//   flight.take(particles, g, horizon);
//   flight.run(end, report);
//   flight.give_back(end, particles);
//
// All of it is collective. No rank has all particles: between epochs it has a block of them (id_blocks.h), in an epoch
// those of its subdomain and their ghosts. Where there are too few particles for all ranks, or the box has no room for
// so many subdomains, the last ranks have none.

#include <optional>

#include "engine/ranks/id_blocks.h"
#include "engine/ranks/path_exchange.h"
#include "engine/ranks/window_length.h"

namespace carom {

template <int D>
class WindowedFlight {
 public:
  using Report = typename EventCore<D>::Report;

  /// `window` forces the length of windows [time].
  WindowedFlight(const Box<D>& box, Sizes sizes, Communicator& ranks, const SearchOptions& options = {},
                 std::function<double()> window = {});

  /// As EventCore::take(), load() and so on. Particles are this rank's block; contacts are reported on rank 0.
  void take(Particles<D>& particles, const Vec<D>& g, double horizon);
  double run(double end, const Report& report);
  void fly_to(double time, Particles<D>& copies) const;
  void give_back(double time, Particles<D>& particles);
  double now() const { return now_; }

  /// Of this rank, since the flight was made.
  EventCounts counts() const;
  WindowCounts window_counts() const;

 private:
  IdBlocks blocks() const { return {sizes_.spheres, static_cast<std::size_t>(ranks_.size())}; }
  void make_subdomain(std::size_t subdomains);
  void measure_work();
  void collect(double time, Particles<D>& copies, std::vector<std::uint32_t>* work) const;
  void reload();
  template <class Spheres>
  void load(double now, Spheres&& spheres);
  Vec<D> place(const Record<D>& r, double now) const;
  void sort_out(bool loaded);
  double cut_at(double time);
  EventKey<D> key_of_collision(std::uint64_t number) const;
  ContactTally tally() const { return subdomain_ ? subdomain_->tally() : ContactTally{}; }

  const Box<D>& box_;
  Sizes sizes_;
  Communicator& ranks_;
  std::size_t subdomains_ = 0;
  SearchOptions options_;
  std::optional<Bisection<D>> bisection_;
  std::unique_ptr<Subdomain<D>> subdomain_;  // of this rank, with its number; null: it has none
  PathExchange<D> exchange_;
  WindowLength<D> length_;
  Vec<D> g_ = Vec<D>::Zero();
  double horizon_ = 0, now_ = 0;
  bool sorted_ = false;       // owners and ghosts are those of now_
  bool cut_ = false;          // the last window was cut, and subdomains must be loaded again
  std::uint64_t events_ = 0;  // contacts since take()
  // How much the subdomain had to do in the epoch, a sphere of it, the mean of all being kUsualWork; and each sphere of
  // this rank's block.
  std::uint32_t subdomain_work_ = 0;
  std::vector<std::uint32_t> work_;
  std::uint64_t run_before_ = 0;  // events of first runs, before the epoch
  EventCounts event_counts_;      // of a subdomain that is no more
  WindowCounts counts_;
};

}  // namespace carom
