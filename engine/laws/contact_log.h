// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A collision, as observers receive it.

#include <compare>
#include <string>
#include <utility>

#include "engine/laws/box.h"

namespace carom {

/// A kick by the bath is an event of one particle, like a contact with a wall.
enum class EventKind : std::uint8_t { pair = 0, wall = 1, kick = 2 };

/// A total order of events, the same on every machine and for every decomposition. `generation` orders events at the
/// same instant: it is 1 + the largest generation of the partners' records with the time of the event, or 0 if there is
/// none.
template <int D>
struct EventKey {
  double time = 0;  ///< since the start of the slab or epoch
  std::uint32_t generation = 0;
  EventKind kind = EventKind::pair;
  Id lo = 0;  ///< the lower id; of a wall or kick event the particle
  Id hi = 0;  ///< the higher id; of a wall event the number of the wall, of a kick 0
  Image<D> image{};
  auto operator<=>(const EventKey&) const = default;
};

/// The key of a contact between two spheres with separation x_first − x_second + shift(image).
template <int D>
EventKey<D> pair_key(double time, std::uint32_t generation, Id first, Id second, Image<D> image) {
  if (second < first) {
    std::swap(first, second);
    for (auto& k : image) k = -k;
  }
  return {.time = time, .generation = generation, .lo = first, .hi = second, .image = image};
}

/// Names the partners for messages: "particles 3 and 7", "particle 3 and the upper wall of axis 1".
template <int D>
std::string partners(const EventKey<D>& key, const Box<D>& box) {
  const std::string lo = std::to_string(key.lo);
  if (key.kind == EventKind::pair) return "particles " + lo + " and " + std::to_string(key.hi);
  return "particle " + lo + " and " + (key.kind == EventKind::kick ? "the bath" : box.wall_name(key.hi));
}

/// What happens to two spheres: a collision of their cores, or an event at a step (steps.h).
enum class PairEvent : std::uint8_t { core = 0, enter = 1, leave = 2, bounce = 3 };

/// The energies of a contact: the kinetic energy changes by work + heat − dissipated − stored.
struct Exchange {
  double virial = 0;                  ///< of a pair: (x_lo − x_hi)·impulse as computed [energy]
  double impulse = 0;                 ///< of a wall: on the sphere, along the wall's normal [mass·length/time]
  double work = 0;                    ///< that a moving wall does on the sphere [energy]
  double heat = 0;                    ///< that the sphere gets from a thermal wall or a bath [energy]
  double dissipated = 0;              ///< energy lost [energy]
  double stored = 0;                  ///< energy that a step takes from the motion [energy]
  double shear = 0;                   ///< energy that the flow of a sheared box gives, with that of flights [energy]
  PairEvent event = PairEvent::core;  ///< of a pair
};

/// An exchange in three numbers, for logs of many contacts; `event` is kept beside them.
struct PackedExchange {
  double first = 0;  ///< the virial of a pair, the impulse of a wall
  double lost = 0;   ///< what is dissipated; where a pair enters or leaves, what is stored; of a thermal wall or a bath
                     ///< the heat, negated
  double shear = 0;  ///< Exchange::shear

  PackedExchange() = default;
  PackedExchange(EventKind kind, const Exchange& all)
      : first(kind == EventKind::pair ? all.virial : all.impulse),
        lost(all.dissipated + all.stored - all.heat),
        shear(all.shear) {}
  /// `number`: that of the wall, if it is one.
  template <int D>
  Exchange unpacked(EventKind kind, PairEvent event, Id number, const Box<D>& box, double time) const {
    if (kind == EventKind::pair) {
      const bool crosses = event == PairEvent::enter || event == PairEvent::leave;
      return {.virial = first,
              .dissipated = crosses ? 0 : lost,
              .stored = crosses ? lost : 0,
              .shear = shear,
              .event = event};
    }
    if (kind == EventKind::kick) return {.heat = -lost, .shear = shear};
    const Wall<D> wall = box.wall(number);
    Exchange all{.impulse = first, .work = wall.velocity_at(time) * first, .shear = shear};
    (wall.thermal() ? all.heat : all.dissipated) = wall.thermal() ? -lost : lost;
    return all;
  }
};

/// One executed collision.
template <int D>
struct Contact {
  EventKey<D> key;
  Vec<D> x_lo, x_hi;  ///< centres at contact [length], x_hi at the image that is touched; for a wall event x_hi is the
                      ///< point touched
  Vec<D> impulse;     ///< on `lo`; `hi` receives its negative [mass·length/time]
  Exchange exchange{};
  double overlap = 0;  ///< at contact, relative to the contact distance, if the method computes it
  double sigma = 0;    ///< then the contact distance; for a sphere and a wall it is the radius [length]
  /// Velocities after the contact [length/time]; for a wall event v_hi is 0.
  Vec<D> v_lo = Vec<D>::Zero(), v_hi = Vec<D>::Zero();
};

}  // namespace carom
