// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Counts and sums over executed contacts. The tallies of several ranks can be added.

#include <algorithm>
#include <string>
#include <tuple>
#include <vector>

#include "engine/base/archive.h"
#include "engine/base/exact_sum.h"
#include "engine/laws/contact_log.h"

namespace carom {

/// Sums over the contacts with a wall.
struct WallTally {
  std::uint64_t contacts = 0;
  ExactSum impulse;  ///< on spheres, along the normal [mass·length/time]
  ExactSum work;     ///< done on spheres [energy]
  ExactSum heat;     ///< that spheres got [energy]

  void add(const Exchange& of_contact) {
    ++contacts;
    impulse.add(of_contact.impulse);
    work.add(of_contact.work);
    heat.add(of_contact.heat);
  }
  void add(const WallTally& other) {
    contacts += other.contacts;
    impulse.add(other.impulse);
    work.add(other.work);
    heat.add(other.heat);
  }
};

/// Events of pairs at steps, and the energy that they took from the motion.
struct StepTally {
  std::uint64_t entered = 0, left = 0, bounced = 0;
  ExactSum stored;  ///< [energy]

  std::uint64_t events() const { return entered + left + bounced; }
  void add(const Exchange& exchange) {
    ++(exchange.event == PairEvent::enter ? entered : exchange.event == PairEvent::leave ? left : bounced);
    stored.add(exchange.stored);
  }
  void add(const StepTally& other) {
    entered += other.entered;
    left += other.left;
    bounced += other.bounced;
    stored.add(other.stored);
  }
};

/// Depth relative to the contact distance up to which an overlap is taken for rounding. Contacts touch within the gap
/// tolerance (wall.h), 1e-13 of the contact distance, and the methods leave up to ten times as much; this is a hundred
/// times. Where 4 ulp of the box are the larger tolerance, see kRoundingOfPositions (engine/run/monitor.cc).
inline constexpr double kRoundingOfOverlaps = 1e-11;

/// An overlap of two spheres, or of a sphere and a wall.
struct Overlap {
  double depth = 0;   ///< relative to the contact distance
  double length = 0;  ///< [length]
  double time = 0;    ///< since the start of the slab
  EventKind kind = EventKind::pair;
  Id lo = 0, hi = 0;  ///< as in EventKey

  Overlap() = default;
  /// `sigma`: the contact distance; for a sphere and a wall it is the radius.
  template <int D>
  Overlap(double relative, double sigma, const EventKey<D>& key)
      : depth(relative), length(relative * sigma), time(key.time), kind(key.kind), lo(key.lo), hi(key.hi) {}
  /// Whether it is longer; a total order, so that no two ranks choose differently.
  bool is_worse_than(const Overlap& other) const {
    return std::tuple(-length, time, kind, lo, hi) <
           std::tuple(-other.length, other.time, other.kind, other.lo, other.hi);
  }
};

/// "particles 3 and 7 overlap, by 2e-08 of their contact distance".
template <int D>
std::string overlap_text(const Overlap& overlap, const Box<D>& box) {
  EventKey<D> key{.kind = overlap.kind, .lo = overlap.lo, .hi = overlap.hi};
  return partners(key, box) + " overlap, by " + short_text(overlap.depth) +
         (overlap.kind == EventKind::pair ? " of their contact distance" : " of its radius");
}

struct OverlapTally {
  double max_overlap = 0;  ///< the deepest one, relative to the contact distance
  /// The longest one of the present slab that is deeper than kRoundingOfOverlaps; with positions of one size, either it
  /// is more than rounding or none is.
  Overlap worst{};

  /// `overlap()` names the partners of a deep one.
  template <class Named>
  void note_overlap(double depth, Named&& overlap) {
    max_overlap = std::max(max_overlap, depth);
    if (depth > kRoundingOfOverlaps) [[unlikely]]
      note(overlap());
  }
  void add(const OverlapTally& other) {
    max_overlap = std::max(max_overlap, other.max_overlap);
    note(other.worst);
  }

 private:
  void note(const Overlap& overlap) {
    if (overlap.is_worse_than(worst)) worst = overlap;
  }
};

struct ContactTally : OverlapTally {
  std::uint64_t sphere_sphere = 0;  ///< executed pair collisions
  std::uint64_t sphere_wall = 0;    ///< executed wall collisions
  std::uint64_t kicks = 0;          ///< kicks by a bath
  ExactSum collision_virial;        ///< Σ d·impulse over pair collisions [mass·length²/time]
  ExactSum dissipated;              ///< energy lost at contacts [energy]
  ExactSum work;                    ///< work done on spheres by moving walls [energy]
  ExactSum shear;                ///< energy that the flow of a sheared box gave to the motion relative to it [energy]
  ExactSum heat;                 ///< energy that spheres got from walls and baths with a temperature [energy]
  StepTally steps;               ///< events of pairs at steps
  std::vector<WallTally> walls;  ///< by number, as far as walls were hit

  /// What kinetic and potential energy have lost to the surroundings: H + drained() is conserved.
  double drained() const { return dissipated.value() - work.value() - shear.value() - heat.value(); }

  std::uint64_t contacts() const { return sphere_sphere + steps.events() + sphere_wall; }
  /// The sums of a wall.
  WallTally& wall(Id number) {
    if (walls.size() <= number) walls.resize(number + 1);
    return walls[number];
  }
  /// `number`: that of the wall, if it is one.
  void add(EventKind kind, Id number, const Exchange& exchange) {
    if (kind == EventKind::pair) return add_pair(exchange);
    if (kind == EventKind::wall) return add_wall(number, exchange);
    ++kicks;
    heat.add(exchange.heat);
    if (exchange.shear != 0) shear.add(exchange.shear);
  }
  void add_pair(const Exchange& exchange) {
    if (exchange.event == PairEvent::core)
      ++sphere_sphere;
    else
      steps.add(exchange);
    collision_virial.add(exchange.virial);
    if (exchange.dissipated != 0) dissipated.add(exchange.dissipated);
    if (exchange.shear != 0) shear.add(exchange.shear);
  }
  void add_wall(Id number, const Exchange& exchange) {
    ++sphere_wall;
    wall(number).add(exchange);
    for (const auto& [sum, term] : {std::pair{&work, exchange.work},
                                    {&heat, exchange.heat},
                                    {&dissipated, exchange.dissipated},
                                    {&shear, exchange.shear}})
      if (term != 0) sum->add(term);
  }
  void add(const ContactTally& other) {
    sphere_sphere += other.sphere_sphere;
    sphere_wall += other.sphere_wall;
    kicks += other.kicks;
    OverlapTally::add(other);
    collision_virial.add(other.collision_virial);
    dissipated.add(other.dissipated);
    work.add(other.work);
    shear.add(other.shear);
    heat.add(other.heat);
    steps.add(other.steps);
    for (std::size_t number = other.walls.size(); number-- > 0;) wall(static_cast<Id>(number)).add(other.walls[number]);
  }
  void archive(Archive& archive) {
    archive(sphere_sphere, sphere_wall, kicks, max_overlap, worst, collision_virial, dissipated, work, shear, heat,
            steps, walls);
  }
  /// Counts a contact and appends it to `log` unless `log` is null.
  template <int D>
  void record(const Contact<D>& contact, std::vector<Contact<D>>* log) {
    add(contact.key.kind, contact.key.hi, contact.exchange);
    note_overlap(contact.overlap, [&] { return Overlap(contact.overlap, contact.sigma, contact.key); });
    if (log) log->push_back(contact);
  }
};

/// Throws the error for a step with more contacts than `most`; `last` names the partners of the last one, if known.
[[noreturn]] void throw_too_many_contacts(const ContactLaws& laws, std::uint64_t most, const std::string& last = "");

}  // namespace carom
