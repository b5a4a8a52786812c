// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The spheres of one core and their physics: flight, contact, collision. event_search.h decides for which pairs
// contacts are computed, event_core.h when.
//
// Between contacts every sphere moves on x + v s + g s²/2 from its record. All radii may grow by a common factor 1 +
// growth·t. A contact is a pure function of two records: it depends neither on when it is computed nor on the lists.

#include <span>

#include "engine/base/pages.h"
#include "engine/base/particles.h"
#include "engine/base/record.h"
#include "engine/base/sizes.h"
#include "engine/laws/box.h"
#include "engine/laws/contact_log.h"
#include "engine/search/cell_grid.h"
#include "engine/search/simd/scan.h"

namespace carom {

/// The result of an event: a contact or a kick.
template <int D>
struct EventResult {
  Vec<D> d;        ///< from the second centre to the first [length]
  Vec<D> impulse;  ///< impulse on the first sphere [mass·length/time]
  Exchange exchange;
  double overlap;  ///< at contact, relative to the contact distance
  double sigma;    ///< the contact distance; for a sphere and a wall it is the radius [length]
};

template <int D>
class Flights {
 public:
  explicit Flights(const Box<D>& box) : box_(box), walls_(box.walls()), gap_tolerance_(box.gap_tolerance()) {}

  /// Assigns a slot to every particle.
  void assign(std::span<const Id> order);

  /// Starts a slab: all spheres at time 0, in the slots assigned before.
  void load(const Particles<D>& particles, const Vec<D>& g, double horizon, double growth);

  /// Loads records of various times, with room for spheres that are admitted later. `internal`: the internal state of
  /// each, if there is one; `order`: the record in each slot, if not the one with its number.
  void load(std::span<const Record<D>> records, const Sizes& sizes, const Vec<D>& g, double horizon,
            std::span<const Internal<D>> internal = {}, std::span<const std::uint32_t> order = {});

  /// Frees the memory for spheres until the next load().
  void release() { PageVector<Record<D>>().swap(records_); }

  std::size_t size() const { return records_.size(); }
  std::size_t capacity() const { return capacity_; }
  const Packing<D>& packing() const { return packing_; }
  const Record<D>& operator[](Slot i) const { return records_[i]; }
  std::span<const Record<D>> records() const { return records_; }
  /// Whether pairs have steps; spheres that grow have none.
  bool has_steps() const { return has_steps_; }
  /// Whether spheres have an internal state (ContactLaws::need_internal()).
  bool has_internal() const { return has_internal_; }
  /// The internal state of a sphere; zero if spheres have none.
  Internal<D> internal(Slot i) const { return has_internal_ ? internal_[i] : Internal<D>{}; }
  const Vec<D>& g() const { return g_; }
  bool field() const { return field_; }
  double horizon() const { return horizon_; }

  /// The reaches at time t: by slot, or a single value if all are equal.
  std::vector<double> reaches(double t) const;
  /// The positions of all spheres at a time, by slot.
  std::vector<Vec<D>> places(double t) const {
    std::vector<Vec<D>> places;
    places.reserve(size());
    for (Slot i = 0; i < size(); ++i) places.push_back(at(i, t).x);
    return places;
  }
  /// The speed in a record relative to the flow.
  double speed(const Record<D>& r) const { return sheared_ ? (r.v - flow(r)).norm() : r.v.norm(); }
  bool sheared() const { return sheared_; }
  double shear_rate() const { return box_.shear_rate; }
  /// The extent of the positions in the records.
  Extent<D> extent() const;
  /// The settings for the kernels of scan.h.
  ScanSetting setting() const;

  /// The record, advanced to time t.
  [[gnu::always_inline]] Record<D> at(Slot i, double t) const { return at(records_[i], t); }
  [[gnu::always_inline]] Record<D> at(Record<D> r, double t) const {
    advance(r, t);
    return r;
  }
  /// 1 + the generation of the record if the record has exactly this time, else 0 (EventKey).
  static std::uint32_t generation_at(const Record<D>& r, double t) { return r.t == t ? r.generation + 1u : 0u; }
  std::uint32_t generation_at(Slot i, double t) const { return generation_at(records_[i], t); }

  /// The time at which two spheres next touch or reach a step, with `offset` added to x_i − x_j; infinite if never.
  /// Exchanging the two gives the same bits, because every difference only changes its sign.
  double pair_contact(Slot i, Slot j, const Offset<D>& offset) const {
    return pair_contact(i, records_[i], j, records_[j], offset);
  }

  /// Executes the event of two spheres at time t: a collision of their cores, or an event at a step.
  EventResult<D> collide(Slot i, Slot j, const Offset<D>& offset, double t, std::uint32_t generation) {
    if (has_internal_) [[unlikely]]
      return collide(i, records_[i], internal_[i], j, records_[j], internal_[j], offset, t, generation);
    if (has_steps_) [[unlikely]] {
      Internal<D> none[2];
      return collide(i, records_[i], none[0], j, records_[j], none[1], offset, t, generation);
    }
    return collide_smooth(i, records_[i], j, records_[j], offset, t, generation);
  }

  // The functions above for records other than the present ones. Internal states change; they are not read if spheres
  // have none.
  double pair_contact(Slot i, const Record<D>& a, Slot j, const Record<D>& b, const Offset<D>& offset) const;
  /// Whether the last event of both was one with each other, perhaps.
  static bool just_met(const Record<D>& a, const Record<D>& b) {
    return a.t == b.t && a.generation == b.generation && a.t != 0;
  }
  /// The steps of two spheres; null: they have none.
  const PairSteps* steps_of(const Record<D>& a, const Record<D>& b) const {
    return has_steps_ ? box_.steps.find(a.id, a.species, b.id, b.species) : nullptr;
  }
  EventResult<D> collide(Slot i, Record<D>& a, Internal<D>& in_a, Slot j, Record<D>& b, Internal<D>& in_b,
                         const Offset<D>& offset, double t, std::uint32_t generation) const;

  void set(Slot i, const Record<D>& r, const Internal<D>& internal) {
    records_[i] = r;
    if (has_internal_) internal_[i] = internal;
  }
  /// Stores a sphere in slot `i`, an existing one or the next.
  void admit(Slot i, const Record<D>& r, double radius, double mass, const Internal<D>& internal);

  /// The contact reported to observers after a collision of two spheres, or after a lone event. Under shear its
  /// velocities are relative to the flow.
  Contact<D> contact_of(const EventKey<D>& key, const Record<D>& a, const Record<D>& b, const Offset<D>& offset,
                        const EventResult<D>& result) const;
  Contact<D> contact_of(const EventKey<D>& key, const Record<D>& r, const EventResult<D>& result) const;

  // Lone events are the events of one sphere without a partner: contacts with walls and kicks by a bath.
  bool has_lone_events() const { return lone_events_; }
  /// Calls visit(time, kind, number of the wall) with the next event of each kind and each wall that a sphere with this
  /// record has; the time is infinite if there is none.
  template <class Visit>
  void visit_lone_events(Slot i, const Record<D>& r, Visit&& visit) const {
    for (const Wall<D>& wall : walls_) visit(wall_contact(i, r, wall), EventKind::wall, wall.number);
    if (kicks_) visit(next_kick(i, r), EventKind::kick, Id{0});
  }
  /// Executes a lone event; the second "centre" is the point of the wall that is touched.
  EventResult<D> meet_alone(const EventKey<D>& key, Slot i, Record<D>& r, Internal<D>* internal) const;
  EventResult<D> meet_alone(const EventKey<D>& key, Slot i) {
    return meet_alone(key, i, records_[i], has_internal_ ? &internal_[i] : nullptr);
  }

  /// The contact distance of two spheres at time 0; the radius of one [length].
  double contact_distance(Slot i, Slot j) const { return radius(i) + radius(j); }
  /// The reach (Sizes) at the start of the slab.
  double reach(Slot i) const { return box_.steps.reach()(radius(i)); }
  double radius(Slot i) const { return radius_.empty() ? common_radius_ : radius_[i]; }
  /// Whether all spheres have the same radius.
  bool equal() const { return common_radius_ != 0; }

 private:
  /// Spheres without an internal state pay nothing for it.
  template <bool kInternal>
  EventResult<D> collide_with(Slot i, Record<D>& a, Internal<D>* in_a, Slot j, Record<D>& b, Internal<D>* in_b,
                              const Offset<D>& offset, double t, std::uint32_t generation) const;
  EventResult<D> collide_smooth(Slot i, Record<D>& a, Slot j, Record<D>& b, const Offset<D>& offset, double t,
                                std::uint32_t generation) const;
  [[gnu::noinline]] EventResult<D> meet_step(const StepSurface& step, Slot i, Record<D>& a, Slot j, Record<D>& b,
                                             const Vec<D>& d, std::uint32_t generation) const;
  /// The separation of two spheres at the time of their records, with the image.
  Vec<D> separation(const Record<D>& a, const Record<D>& b, const Offset<D>& offset) const {
    Vec<D> d = a.x - b.x + offset.start;
    if (sheared_) [[unlikely]]
      d[0] += offset.slide * a.t;
    return d;
  }
  Vec<D> relative_velocity(const Record<D>& a, const Record<D>& b, const Offset<D>& offset) const {
    Vec<D> v = a.v - b.v;
    if (sheared_) [[unlikely]]
      v[0] += offset.slide;
    return v;
  }
  /// The velocity of the flow at the place of a sphere; zero without shear.
  Vec<D> flow(const Record<D>& r) const {
    Vec<D> flow = Vec<D>::Zero();
    if (sheared_) flow[0] = box_.flow(r.x);
    return flow;
  }
  void set_surroundings();
  void set_surfaces();
  /// The time at which a sphere touches a wall. Throws Error(Failure::numerical) if it rests there under the field.
  double wall_contact(Slot i, const Record<D>& r, const Wall<D>& wall) const;
  double next_kick(Slot i, const Record<D>& r) const;
  [[gnu::always_inline]] void advance(Record<D>& r, double t) const {
    const double s = t - r.t;
    if (s != 0) {
      r.x += s * r.v;
      if (field_) [[unlikely]] {
        r.x += (0.5 * s * s) * g_;
        r.v += s * g_;
      }
    }
    r.t = t;
  }
  /// The spheres of a compression, which grow, are elastic.
  const ContactLaws& laws() const { return growth_ == 0 ? box_.contacts : elastic_; }
  double grown(double length, double t) const { return length * (1 + growth_ * t); }
  double mass(Slot i) const { return mass_.empty() ? common_mass_ : mass_[i]; }

  const Box<D>& box_;
  ContactLaws elastic_;
  std::vector<Wall<D>> walls_;
  Vec<D> g_ = Vec<D>::Zero();
  bool field_ = false, has_internal_ = false, has_steps_ = false, kicks_ = false, lone_events_ = false,
       sheared_ = false;
  double growth_ = 0, horizon_ = 0;
  GapTolerance gap_tolerance_;
  PageVector<Record<D>> records_;  // by slot
  std::size_t capacity_ = 0;       // largest number of spheres
  Packing<D> packing_;
  std::vector<double> radius_, mass_;  // by slot; empty if all are equal
  std::vector<Internal<D>> internal_;  // by slot; empty if spheres have none
  double common_radius_ = 0, common_mass_ = 0;
  std::vector<ScanSurface> surfaces_;  // for the kernels; empty if they do not know the steps
};

}  // namespace carom
