// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The simulation box: a rectangle or cuboid from the origin to `edges` with a boundary rule for each axis, and all
// walls.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/laws/bath.h"
#include "engine/laws/boundary.h"
#include "engine/laws/contact_law.h"
#include "engine/laws/steps.h"
#include "engine/laws/wall.h"

namespace carom {

/// A wall beside the box, or a face of the box that is more than a fixed hard wall. Box::add() checks and completes it.
template <int D>
struct WallOptions {
  std::string name;                ///< a face of the box: "x-", "x+", "y-", …; another name: a further wall
  Vec<D> normal = Vec<D>::Zero();  ///< a further wall: points to the side of the spheres; any length
  double offset = 0;               ///< a further wall: normal·x = offset at time 0
  double velocity = 0;             ///< along the normal [length/time]
  double amplitude = 0;   ///< shaken: the displacement along the normal is amplitude·sin(2π(turns + frequency·time))
  double frequency = 0;   ///< [1/time]
  double turns = 0;       ///< phase of the sine at time 0, in turns
  bool one_sided = true;  ///< false: it acts on the spheres on both sides
  bool one_way = false;   ///< it reflects spheres that come from the side of the normal, and lets others pass
  double temperature = 0;  ///< a thermal wall has one [energy]; 0: the wall is not thermal
  std::uint64_t seed = 1;  ///< seed of the random numbers of a thermal wall
  double moved = 0;        ///< displacement before time 0, of the centre of a sine [length]
  double until = std::numeric_limits<double>::infinity();  ///< when its motion ends, since time 0
  double round = 0;    ///< radius of a sphere or, if `direction` is not zero, of a cylinder; 0: a plane [length]
  bool inside = true;  ///< the spheres are inside a round wall; false: outside
  Vec<D> centre = Vec<D>::Zero();     ///< of a round wall; of a cylinder: any point of its axis [length]
  Vec<D> direction = Vec<D>::Zero();  ///< along the axis of a cylinder; any length
  Id number = 0;                      ///< set by add(); the rear of a wall with two sides has the next number

  /// Whether it moves or has moved.
  bool moves() const { return velocity != 0 || amplitude != 0 || moved != 0; }
  /// How far it has moved along its normal.
  double displacement(double time) const {
    time = std::min(time, until);
    const double smooth = moved + velocity * time;
    return amplitude == 0 ? smooth : smooth + amplitude * cosine_and_sine(turns + frequency * time)[1];
  }
  /// Whether its motion is over; the rounding of the sum of the lengths of slabs does not matter.
  bool rests(double time) const { return time >= until * (1 - 1e-12); }
  /// Makes `time` its time 0: it stays where it is and goes on as it moves.
  void restart(double time) {
    const double moving = std::min(time, until);
    moved += velocity * moving;
    if (amplitude != 0) turns = std::fmod(turns + frequency * moving, 1.0);
    until -= moving;
  }
};

/// Where an image of the box is during a slab: what to add to the separation of two spheres at the start of the slab,
/// and how fast this changes.
template <int D>
struct Offset {
  Vec<D> start = Vec<D>::Zero();  ///< [length]
  double slide = 0;               ///< along the first axis; it is not zero under shear only [length/time]

  /// The displacement at a time after the start of the slab.
  Vec<D> at(double elapsed) const {
    Vec<D> displaced = start;
    displaced[0] += slide * elapsed;
    return displaced;
  }
};

template <int D>
struct Box {
  Vec<D> edges = Vec<D>::Ones();  ///< at time 0 [length]
  std::array<Boundary, D> boundary{};
  std::vector<WallOptions<D>> options{};  ///< the walls that add() has added or changed
  Bath bath{};
  double time = 0;                  ///< the start of the slab, since the start of the run
  double step_start = 0, step = 0;  ///< the step of a stepping method; step = 0: shaken walls move on a sine
  bool straight = false;            ///< shaken walls move straight over each step
  ContactLaws contacts{};
  Steps steps{};
  double shear_rate = 0;  ///< of Lees–Edwards boundaries: dv_x/dy of the flow; the images above slide along x [1/time]
  /// For a flow that changes: times, each with the rate from then on; before the first time it rests. Then
  /// `shear_rate` is the present one. Empty: `shear_rate` is constant.
  std::vector<std::array<double, 2>> shear_rates{};
  double tilt = 0;         ///< where the image above is along x at `time`; between slabs in [0, edges[0]) [length]
  double next_tilt = 0;    ///< at the end of the piece over which mean forces are computed [length]
  std::int32_t turns = 0;  ///< the number of edges that shorten_tilt() has taken off; only its changes have a meaning

  /// Whether the lattice of images is not that of the edges alone: it slides, or stays tilted after a flow.
  bool sheared() const { return shear_rate != 0 || tilt != 0 || !shear_rates.empty(); }
  /// The rate of shear at a time.
  double shear_rate_at(double at) const {
    double rate = shear_rates.empty() ? shear_rate : 0;
    for (const auto& [from, next] : shear_rates)
      if (reached(from, at)) rate = next;
    return rate;
  }
  /// The largest rate of shear of all times, without its sign.
  double fastest_shear() const {
    double fastest = std::abs(shear_rate);
    for (const auto& each : shear_rates) fastest = std::max(fastest, std::abs(each[1]));
    return fastest;
  }
  /// The strain between two times; NaN if the flow rests or turns.
  double strain(double begin, double end) const;
  /// The velocity of the flow along x at a position. Positions along y are unwrapped.
  double flow(const Vec<D>& x) const { return shear_rate * x[1]; }
  /// How fast the image above slides [length/time].
  double slide() const { return shear_rate * edges[1]; }
  /// Moves on to start + elapsed from the start of a slab, when the tilt was `tilted`. Returns the number of edges by
  /// which the tilt has been made shorter.
  std::int32_t pass(double start, double tilted, double elapsed) {
    time = start + elapsed;
    if (!sheared()) return 0;
    tilt = tilted + slide() * elapsed;
    auto boxes = static_cast<std::int32_t>(std::floor(tilt / edges[0]));
    tilt -= boxes * edges[0];
    if (tilt >= edges[0]) tilt = 0, ++boxes;  // a tiny negative value rounds up
    return boxes;
  }

  /// Moves on within a slab of a method with steps; the tilt may become longer than the edge.
  void advance(double elapsed) {
    time += elapsed;
    if (sheared()) tilt += slide() * elapsed;
  }
  /// Brings the tilt back between 0 and the edge; returns the number of edges that it has become shorter.
  std::int32_t shorten_tilt() {
    if (tilt >= 0 && tilt < edges[0]) return 0;
    const std::int32_t boxes = pass(time, tilt, 0);
    turns += boxes;
    return boxes;
  }

  bool periodic(int axis) const { return boundary[axis] == Boundary::periodic; }
  bool walled(int axis) const { return boundary[axis] == Boundary::wall; }
  /// Whether some axis has this boundary.
  bool has(Boundary kind) const { return std::ranges::find(boundary, kind) != boundary.end(); }
  bool has_walls() const { return has(Boundary::wall) || !options.empty(); }

  /// Adds a wall, or changes a face of the box; edges and boundaries must be set. Throws Error(Failure::deck).
  void add(WallOptions<D> wall);
  /// The options of a wall; null: it is a fixed hard face of the box.
  const WallOptions<D>* find(Id number) const {
    for (const WallOptions<D>& each : options)
      if (each.number == number || (!each.one_sided && each.number + 1 == number)) return &each;
    return nullptr;
  }
  /// Whether the walls are the fixed faces of the box, so that its volume is that of the spheres.
  bool plain() const {
    return std::ranges::all_of(options, [](const auto& each) { return each.number < 2 * D && !each.moves(); });
  }
  /// Whether all positions along the axis stay between 0 and the edge at all times.
  bool bounded(int axis) const {
    return boundary[axis] != Boundary::open && std::ranges::none_of(options, [&](const auto& each) {
             return each.moves() && each.number / 2 == static_cast<Id>(axis);
           });
  }
  /// Whether all axes are bounded, so that the box has a density.
  bool closed() const {
    for (int k = 0; k < D; ++k)
      if (!bounded(k)) return false;
    return true;
  }
  /// The wall with this number, from `time` on; it must exist.
  Wall<D> wall(Id number) const {
    const WallOptions<D>* const its = find(number);
    Wall<D> wall{.number = number};
    if (number < 2 * D) {
      wall.axis = static_cast<int>(number / 2);
      wall.normal = (number % 2 == 0 ? 1.0 : -1.0) * Vec<D>::Unit(wall.axis);
      wall.offset = number % 2 == 0 ? 0.0 : -edges[wall.axis];
    } else {
      wall.normal = its->normal;
      wall.offset = its->offset;
      wall.one_sided = its->one_sided;
      wall.round = its->round;
      wall.inside = its->inside;
      wall.centre = its->centre;
      wall.direction = its->direction;
      if ((wall.one_way = its->one_way)) wall.depth = 1e3 * gap_tolerance()(0);
    }
    if (!its) return wall;
    set_motion(*its, wall);
    wall.temperature = its->temperature;
    wall.seed = its->seed;
    if (number != its->number) {  // the rear
      wall.normal = -wall.normal;
      wall.offset = -wall.offset;
      wall.velocity = -wall.velocity;
      wall.acceleration = -wall.acceleration;
      wall.amplitude = -wall.amplitude;
    }
    return wall;
  }
  /// The area of a wall at a time: of a face of the box, of a sphere, of a cylinder along an axis of the box; 0: it has
  /// none [length^(D−1)].
  double area(const Wall<D>& wall, double at) const;
  /// All walls, ordered by number.
  std::vector<Wall<D>> walls() const;
  /// Call this at the start of a slab. `length`: of the step of a stepping method, else 0.
  void begin_step(double start, double length) {
    time = step_start = start;
    step = length;
    shear_rate = shear_rate_at(start);
  }
  /// When the motion of a wall ends that still moves at this time, or the rate of shear changes; infinite if neither
  /// does.
  double next_end(double at) const {
    double next = std::numeric_limits<double>::infinity();
    for (const WallOptions<D>& each : options)
      if (each.moves() && !each.rests(at)) next = std::min(next, each.until);
    for (const auto& each : shear_rates)
      if (!reached(each[0], at)) next = std::min(next, each[0]);
    return next;
  }
  /// The longest step that the walls allow; infinite if none is shaken [time].
  double longest_step() const;
  /// Whether a change of the rate of shear is past, but for the rounding of times in a run.
  bool reached(double change, double at) const { return at >= change * (1 - 1e-12) - 1e-9 * step; }
  /// Makes the present time the time 0 of a new run; walls, ramps and changes of the flow go on.
  void restart();
  /// Throws Error(failure) if two parallel walls leave no room between them, or a step is too long for a shaken wall.
  void check(Failure failure) const;
  /// For messages: "the upper wall of axis 1", "the wall 'ramp'".
  std::string wall_name(Id number) const;
  /// The name of a wall in decks: "x-", "ramp".
  std::string name_of(Id number) const;

  /// The lengths of the box at a time, between its faces [length].
  Vec<D> lengths(double at) const {
    Vec<D> all = edges;
    for (const WallOptions<D>& each : options)
      if (each.number < 2 * D) all[static_cast<int>(each.number / 2)] -= each.displacement(at);
    return all;
  }
  /// The position of the lower face of an axis at a time [length].
  double lower(int axis, double at) const {
    const WallOptions<D>* const face = find(2 * static_cast<Id>(axis));
    return face ? face->displacement(at) : 0.0;
  }
  double volume() const { return lengths(time).prod(); }
  void set_motion(const WallOptions<D>& options, Wall<D>& wall) const;

  /// The gap below which spheres count as touching, anywhere in the box.
  GapTolerance gap_tolerance() const { return GapTolerance(edges.maxCoeff()); }

  /// The image that brings `d`, a difference of two positions, nearest to the origin: the number of edges to add on
  /// each axis.
  Image<D> nearest_image(const Vec<D>& d) const {
    Image<D> image{};
    for (int k = 0; k < D; ++k)
      if (periodic(k) && !(std::abs(d[k]) <= 0.5 * edges[k]))  // else the quotient rounds to zero
        image[k] = -static_cast<std::int32_t>(std::nearbyint(d[k] / edges[k]));
    if (tilt != 0 && image[1] != 0)
      image[0] = -static_cast<std::int32_t>(std::nearbyint((d[0] + image[1] * tilt) / edges[0]));
    return image;
  }

  /// The displacement of an image at `time`.
  Vec<D> shift(const Image<D>& image) const {
    Vec<D> s;
    for (int k = 0; k < D; ++k) s[k] = image[k] == 0 ? 0.0 : image[k] * edges[k];
    if (tilt != 0 && image[1] != 0) s[0] += image[1] * tilt;
    return s;
  }
  /// The displacement of an image at the time of `next_tilt`.
  Vec<D> next_shift(const Image<D>& image) const {
    Vec<D> s = shift(image);
    if (sheared() && image[1] != 0) s[0] = image[0] * edges[0] + image[1] * next_tilt;
    return s;
  }
  /// The displacement and the motion of an image in a slab that starts at `time`.
  Offset<D> offset(const Image<D>& image) const {
    return {shift(image), sheared() && image[1] != 0 ? image[1] * slide() : 0};
  }

  /// Brings a position back into [0, edge) along the periodic axes and counts the crossings in `image`. Throws
  /// Error(failure) if the number of crossings does not fit into `image`. Positions that are not finite stay.
  void wrap(Vec<D>& x, Image<D>& image, Failure failure = Failure::numerical) const {
    constexpr double kMostCrossings = std::numeric_limits<std::int32_t>::max();
    for (const int k : kAxes) {
      if (!periodic(k) || (x[k] >= 0 && x[k] < edges[k])) continue;
      const double crossings = std::floor(x[k] / edges[k]);
      if (crossings == 0 || !std::isfinite(crossings)) continue;
      if (!(std::abs(image[k] + crossings) < kMostCrossings))
        throw Error(failure,
                    "a particle has crossed the periodic box " + short_text(std::abs(image[k] + crossings)) +
                        " times along axis " + std::to_string(k) +
                        "; the numbers of crossings have 32 bits: start it inside the box, enlarge the box, or "
                        "end the run earlier");
      auto boxes = static_cast<std::int32_t>(crossings);
      x[k] -= crossings * edges[k];
      if (x[k] >= edges[k]) {  // a tiny negative x rounds up to the edge itself
        x[k] = 0;
        boxes += 1;
      }
      image[k] += boxes;
      if (k == 1 && tilt != 0) x[0] -= boxes * tilt;
    }
  }

 private:
  /// The order of axes in which positions are wrapped: crossing the second axis of a tilted lattice also moves along
  /// the first.
  static constexpr std::array<int, D> kAxes = [] {
    std::array<int, D> axes{1, 0};
    for (int k = 2; k < D; ++k) axes[k] = k;
    return axes;
  }();
};

}  // namespace carom
