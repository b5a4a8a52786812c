// SPDX-License-Identifier: BSD-3-Clause
#include "engine/laws/box.h"

#include <numbers>

#include "engine/laws/wall_options.h"

namespace carom {
namespace {

/// The longest step, in periods of a shaken wall: its largest speed is wrong by (2π·0.1)²/12, 3 %.
constexpr double kLongestStep = 0.1;

/// A wall counts as parallel to an axis if its unit vector is off by no more than the rounding of a sine or cosine.
constexpr double kParallel = 1e-15;

/// The names of the faces, by number.
template <int D>
std::vector<std::string> face_names() {
  std::vector<std::string> names;
  for (int k = 0; k < D; ++k)
    for (const char side : {'-', '+'}) names.push_back({"xyz"[k], side});
  return names;
}

/// Checks a round wall, and makes its direction a unit vector.
template <int D>
void check_round(WallOptions<D>& wall, const auto& refuse) {
  if (wall.normal != Vec<D>::Zero() || wall.offset != 0)
    refuse("is round and has the normal or the offset of a plane", "leave these out");
  if (wall.moves()) refuse("is round and moves, which only planes do", "leave velocity and moved out");
  if (!wall.one_sided || wall.one_way)
    refuse("is round and lets spheres be on both sides",
           "leave one_sided and one_way out, and take two walls, inside = true and inside = false");
  if (const double length = wall.direction.stableNorm(); length > 0) wall.direction /= length;
}

}  // namespace

template <int D>
void Box<D>::add(WallOptions<D> wall) {
  const auto refuse = [&](const std::string& what, const std::string& remedy) {
    throw Error(Failure::deck, "the wall '" + wall.name + "' " + what + "; " + remedy);
  };
  const auto faces = face_names<D>();
  const auto face = std::ranges::find(faces, wall.name);
  const double length = wall.normal.norm();
  if (!(wall.until >= 0)) refuse("moves until a time that is negative or no number", "give a time since the start");
  if (!std::isfinite(length + wall.offset + wall.velocity + wall.amplitude + wall.frequency + wall.temperature +
                     wall.moved + wall.turns + wall.round + wall.centre.sum() + wall.direction.sum()))
    refuse("has a number that is not finite", "give finite ones");
  if (std::ranges::find(options, wall.name, &WallOptions<D>::name) != options.end())
    refuse("is given twice", "give each wall its own name");
  if (wall.one_way && (!wall.one_sided || wall.amplitude != 0 || face != faces.end()))
    refuse(!wall.one_sided       ? "is one-way and has two sides"
           : face != faces.end() ? "is a face of the box and cannot be one-way, because nothing is behind it"
                                 : "is one-way and shaken",
           !wall.one_sided       ? "leave out one of one_way and one_sided"
           : face != faces.end() ? "choose another name and give a normal"
                                 : "give a constant velocity");
  if (face != faces.end()) {
    wall.number = static_cast<Id>(face - faces.begin());
    if (!walled(static_cast<int>(wall.number / 2)))
      refuse("does not exist, because that boundary is " + std::string(find_boundary(boundary[wall.number / 2]).name),
             "make that boundary a wall");
    if (length > 0 || wall.offset != 0 || !wall.one_sided || wall.round > 0)
      refuse("is a face of the box, which has its normal, its place and one side",
             "leave shape, normal, offset and one_sided out, or choose another name");
  } else {
    if (wall.round > 0)
      check_round(wall, refuse);
    else if (!(length > 0)) {
      std::string known;
      for (int k = 0; k < D; ++k)
        if (walled(k)) known += (known.empty() ? "" : ", ") + faces[2 * k] + ", " + faces[2 * k + 1];
      refuse("is no face of the box and has no normal",
             "give a normal that is not zero" + (known.empty() ? known : ", or the name of a face: " + known));
    }
    if (length > 0) {
      wall.normal /= length;
      wall.offset /= length;
    }
    for (int k = 0; k < D; ++k) {
      if (!periodic(k)) continue;
      // `off` vanishes for a parallel wall: the normal's part along this axis, or the part of a cylinder's direction
      // across.
      Vec<D>& vector = wall.round > 0 ? wall.direction : wall.normal;
      Vec<D> off = vector[k] * Vec<D>::Unit(k);
      if (wall.round > 0) off = vector - off;
      if (!(off.norm() < kParallel) || (wall.round > 0 && vector.isZero(0)))
        refuse("is not the same in all images of the box along axis " + std::to_string(k) + ", which is periodic",
               "make that boundary wall or open, or give a wall that is parallel to the axis");
      vector -= off;
    }
    wall.number = 2 * D;
    for (const WallOptions<D>& each : options)
      if (each.number >= 2 * D) wall.number = each.number + (each.one_sided ? 1 : 2);
  }
  options.push_back(std::move(wall));
}

template <int D>
double Box<D>::area(const Wall<D>& wall, double at) const {
  const Vec<D> length = lengths(at);
  if (wall.axis >= 0) return length.prod() / length[wall.axis];
  const double girth = 2 * std::numbers::pi * wall.round;
  if (D == 2 || wall.direction.isZero(0)) return D == 2 ? girth : 2 * girth * wall.round;
  for (int k = 0; k < D; ++k)
    if (std::abs(wall.direction[k]) == 1) return girth * length[k];
  return 0;
}

template <int D>
std::vector<Wall<D>> Box<D>::walls() const {
  std::vector<Wall<D>> all;
  for (Id number = 0; number < 2 * D; ++number)
    if (walled(static_cast<int>(number / 2))) all.push_back(wall(number));
  for (const WallOptions<D>& each : options) {
    if (each.number < 2 * D) continue;
    all.push_back(wall(each.number));
    if (!each.one_sided) all.push_back(wall(each.number + 1));
  }
  return all;
}

/// Sets where the wall is and how it moves. In a step of length h a shaken wall moves on a parabola. The parabola of an
/// oscillator with the acceleration −Ω²(X + X')/2, where X and X' are its positions at the two ends and Ω =
/// (2/h)·tan(πfh), has the positions of the sine at the ends of all steps and a continuous velocity, of order 2. Where
/// spheres fly straight, it moves straight too: a sphere that is carried along neither sinks in nor gets ahead. In a
/// step of fixed length in which its motion ends, any wall moves straight; other slabs end when the motion ends.
template <int D>
void Box<D>::set_motion(const WallOptions<D>& its, Wall<D>& wall) const {
  if (its.rests(step_start)) {
    wall.offset += its.displacement(time);
    return;
  }
  if (its.until < step_start + step) {  // straight, to where it stops
    const double from = its.displacement(step_start);
    wall.velocity = (its.displacement(step_start + step) - from) / step;
    wall.offset += from + (time - step_start) * wall.velocity;
    return;
  }
  if (its.amplitude == 0) {
    wall.offset += its.displacement(time);
    wall.velocity = its.velocity;
    return;
  }
  wall.offset += its.moved;
  if (step == 0) {
    wall.amplitude = its.amplitude;
    wall.frequency = its.frequency;
    wall.turns = its.turns + its.frequency * time;
    return;
  }
  const auto [cos_half, sin_half] = cosine_and_sine(0.5 * its.frequency * step);
  const auto [cos, sin] = cosine_and_sine(its.turns + its.frequency * step_start);
  const double omega = 2 / step * (sin_half / cos_half), s = time - step_start;
  const double end = cosine_and_sine(its.turns + its.frequency * (step_start + step))[1];
  if (straight) {
    wall.velocity = its.amplitude * (end - sin) / step;
    wall.offset += its.amplitude * sin + s * wall.velocity;
    return;
  }
  wall.acceleration = -0.5 * omega * omega * its.amplitude * (sin + end);
  wall.velocity = omega * its.amplitude * cos + s * wall.acceleration;
  wall.offset += its.amplitude * (sin + s * omega * cos) + 0.5 * s * s * wall.acceleration;
}

template <int D>
void Box<D>::restart() {
  for (WallOptions<D>& each : options) each.restart(time);
  for (auto& each : shear_rates) each[0] -= time;
  bath.ramp_start -= time;
  bath.ramp_end -= time;
  begin_step(0, 0);
}

template <int D>
double Box<D>::strain(double begin, double end) const {
  double sum = 0, path = 0, from = begin, rate = shear_rates.empty() ? shear_rate : 0;
  const auto flow_until = [&](double to) {
    sum += rate * (to - from);
    path += std::abs(rate) * (to - from);
    from = to;
  };
  for (const auto& [change, next] : shear_rates) {
    if (change >= end) break;
    if (change > begin) flow_until(change);
    rate = next;
  }
  flow_until(end);
  return path > 0 && std::abs(sum) == path ? sum : std::numeric_limits<double>::quiet_NaN();
}

template <int D>
double Box<D>::longest_step() const {
  double highest = 0;
  for (const WallOptions<D>& each : options)
    if (!each.rests(time)) highest = std::max(highest, each.frequency);
  return kLongestStep / highest;
}

template <int D>
void Box<D>::check(Failure failure) const {
  for (const WallOptions<D>& each : options)
    if (each.frequency * step > kLongestStep && !each.rests(step_start))
      throw Error(failure, wall_name(each.number) + " is shaken with the period " + short_text(1 / each.frequency) +
                               ", too short for steps of " + short_text(step) + "; take a step of at most " +
                               short_text(kLongestStep / each.frequency));
  if (const std::string cramped = no_room(*this, 0); !cramped.empty()) throw Error(failure, cramped);
}

template <int D>
std::string Box<D>::wall_name(Id number) const {
  if (number >= 2 * D) return "the wall '" + find(number)->name + "'";
  const std::string side = number % 2 == 0 ? "the lower" : "the upper";
  return side + " wall of axis " + std::to_string(number / 2);
}

template <int D>
std::string Box<D>::name_of(Id number) const {
  return number >= 2 * D ? find(number)->name : face_names<D>()[number];
}

template struct Box<2>;
template struct Box<3>;

}  // namespace carom
