// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The spheres of one core and all that may happen to them: flight, contact, collision. The physics is here;
// event_search.h decides for which pairs contacts are computed, event_core.h when.
//
// Between contacts every sphere flies on x + v s + g s²/2 from its record. All radii may grow by a common factor
// 1 + growth·t. A contact is a pure function of two records: neither the time of its computation nor a list is in it.

#include <span>

#include "engine/base/box.h"
#include "engine/base/contact_log.h"
#include "engine/base/pages.h"
#include "engine/base/particles.h"
#include "engine/base/record.h"
#include "engine/base/sizes.h"
#include "engine/search/cell_grid.h"
#include "engine/search/simd/scan.h"

namespace carom {

/// What a collision did.
template <int D>
struct Impact {
  Vec<D> d;        ///< from the second centre to the first [length]
  Vec<D> impulse;  ///< given to the first sphere [mass·length/time]
  double overlap;  ///< at contact, relative to the contact distance
};

template <int D>
class Flights {
 public:
  explicit Flights(const Box<D>& box) : box_(box), walls_(box.walls()), gap_tolerance_(box.gap_tolerance()) {}

  /// Gives every particle a slot.
  void assign(std::span<const Id> order);

  /// Starts a slab: all spheres at time 0, in the slots given before.
  void load(const Particles<D>& particles, const Vec<D>& g, double horizon, double growth);

  /// The same for records of other times, in their order; with room for more that come meanwhile.
  void load(std::span<const Record<D>> records, const Sizes& sizes, const Vec<D>& g, double horizon);

  std::size_t size() const { return records_.size(); }
  std::size_t capacity() const { return capacity_; }
  const Packing<D>& packing() const { return packing_; }
  const Record<D>& operator[](Slot i) const { return records_[i]; }
  std::span<const Record<D>> records() const { return records_; }
  const Vec<D>& g() const { return g_; }
  bool field() const { return field_; }
  double horizon() const { return horizon_; }

  /// One radius where all are equal, else by slot; as they are at a time.
  std::vector<double> radii(double t) const;
  /// The positions of all spheres at a time, by slot.
  std::vector<Vec<D>> places(double t) const {
    std::vector<Vec<D>> places;
    places.reserve(size());
    for (Slot i = 0; i < size(); ++i) places.push_back(at(i, t).x);
    return places;
  }
  /// Of the places at the records.
  Extent<D> extent() const;
  /// What the kernels of scan.h are to know.
  ScanSetting setting() const;

  /// The record as it is at time t.
  Record<D> at(Slot i, double t) const { return at(records_[i], t); }
  Record<D> at(Record<D> r, double t) const {
    advance(r, t);
    return r;
  }
  /// 1 + the generation of the record where it is of this very time, else 0 (EventKey).
  static std::uint32_t generation_at(const Record<D>& r, double t) { return r.t == t ? r.generation + 1u : 0u; }
  std::uint32_t generation_at(Slot i, double t) const { return generation_at(records_[i], t); }

  /// The time at which the two next touch, x_i − x_j taken with `shift`; infinite: never. Exchanging the two gives the
  /// same bits, because every difference only changes its sign.
  double pair_contact(Slot i, Slot j, const Vec<D>& shift) const {
    return pair_contact(i, records_[i], j, records_[j], shift);
  }
  /// The same for a sphere and a wall. Throws Error(Failure::numerical) for a sphere that rests there under the field.
  double wall_contact(Slot i, const Wall<D>& wall) const { return wall_contact(i, records_[i], wall); }

  /// The two collide at time t.
  Impact<D> collide(Slot i, Slot j, const Vec<D>& shift, double t, std::uint32_t generation) {
    return collide(i, records_[i], j, records_[j], shift, t, generation);
  }
  /// The sphere collides with a wall at time t; the second "centre" is the point touched.
  Impact<D> bounce(Slot i, const Wall<D>& wall, double t, std::uint32_t generation) {
    return bounce(i, records_[i], wall, t, generation);
  }

  // The same for spheres with other records than their present ones.
  double pair_contact(Slot i, const Record<D>& a, Slot j, const Record<D>& b, const Vec<D>& shift) const;
  double wall_contact(Slot i, const Record<D>& r, const Wall<D>& wall) const;
  Impact<D> collide(Slot i, Record<D>& a, Slot j, Record<D>& b, const Vec<D>& shift, double t,
                    std::uint32_t generation) const;
  Impact<D> bounce(Slot i, Record<D>& r, const Wall<D>& wall, double t, std::uint32_t generation) const;

  /// Replaces a record.
  void set(Slot i, const Record<D>& r) { records_[i] = r; }
  /// Gives a sphere the slot `i`, one of those there are or the next.
  void admit(Slot i, const Record<D>& r, double radius, double mass);

  /// What observers see of a collision between the two, or with a wall, after it.
  Contact<D> contact_of(const EventKey<D>& key, const Record<D>& a, const Record<D>& b, const Vec<D>& shift,
                        const Impact<D>& impact) const;
  Contact<D> contact_of(const EventKey<D>& key, const Record<D>& r, const Impact<D>& impact) const;

  /// Those of the box.
  std::span<const Wall<D>> walls() const { return walls_; }

  /// Whether all spheres have one radius.
  bool equal() const { return common_radius_ != 0; }

 private:
  void advance(Record<D>& r, double t) const;
  double grown(double length, double t) const { return length * (1 + growth_ * t); }
  double radius(Slot i) const { return radius_.empty() ? common_radius_ : radius_[i]; }
  double mass(Slot i) const { return mass_.empty() ? common_mass_ : mass_[i]; }

  const Box<D>& box_;
  std::vector<Wall<D>> walls_;
  Vec<D> g_ = Vec<D>::Zero();
  bool field_ = false;
  double growth_ = 0, horizon_ = 0;
  GapTolerance gap_tolerance_;
  PageVector<Record<D>> records_;      // by slot
  std::size_t capacity_ = 0;           // how many there may be
  Packing<D> packing_;                 // of their slots
  std::vector<double> radius_, mass_;  // by slot; empty where all are equal
  double common_radius_ = 0, common_mass_ = 0;
};

}  // namespace carom
