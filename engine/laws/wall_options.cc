// SPDX-License-Identifier: BSD-3-Clause
#include "engine/laws/wall_options.h"

namespace carom {

const std::vector<Parameter>& wall_parameters() {
  using enum Parameter::Type;
  using Range = Parameter::Range;
  static const std::vector<Parameter> all = [] {
    Parameter velocity{"velocity", real_or_table, "0.0", "length/time",
                       "along the normal, constant; or { amplitude, frequency }: shaken, displaced along the normal by "
                       "amplitude·sin(2π(frequency·time + phase))"};
    velocity.keys = {{"amplitude", real, "", "length", "the largest displacement"},
                     {"frequency", real, "", "1/time", "oscillations per unit of time", Range::positive}};
    Parameter shape{"shape", text, "\"plane\"", "-",
                    "of a further wall: plane, sphere (a circle in two dimensions) or cylinder"};
    shape.choices = {"plane", "sphere", "cylinder"};
    return std::vector<Parameter>{
        {"name", text, "", "-",
         "x-, x+, y-, y+, z-, z+: a face of the box whose boundary is a wall, to be changed; any other name: a further "
         "wall"},
        shape,
        {"normal", real_list, "none", "-",
         "a further wall: a vector of any length that points to the side of the spheres"},
        {"offset", real, "0.0", "length", "a further wall: at the start it is at normal·x = offset"},
        {"centre", real_list, "none", "length", "of a sphere; of a cylinder: any point of its axis"},
        {"axis", real_list, "none", "-", "of a cylinder: a vector of any length along it"},
        {"radius", real, "none", "length", "of a sphere or cylinder", Range::positive},
        {"inside", boolean, "true", "-", "true: spheres are inside a sphere or cylinder; false: outside"},
        velocity,
        {"moved", real, "0.0", "length",
         "how far it has moved along its normal before the start, from the face of the box or its offset; a shaken "
         "wall: "
         "the centre of its motion"},
        {"until", real, "none", "time", "when its motion ends, since the start; then it stays where it is",
         Range::non_negative},
        {"phase", real, "0.0", "-", "a shaken wall: the part of an oscillation that is over at the start"},
        {"temperature", real, "none", "energy",
         "makes a thermal wall: after a contact the velocity relative to the wall is that of a gas of this temperature "
         "behind the wall",
         Range::positive},
        {"seed", integer, "none", "-", "seed of the random numbers of a thermal wall; default: that of [placement]",
         Range::non_negative},
        {"one_sided", boolean, "true", "-",
         "true: all spheres are on the side of the normal; false: a further wall with spheres on both sides"},
        {"one_way", boolean, "false", "-",
         "true: a further wall that reflects spheres that come from the side of the normal and lets spheres that come "
         "from the other side pass; one that turns back before it is through leaves as it came"}};
  }();
  return all;
}

template <int D>
void add_wall(Box<D>& box, const Parameters& given, std::uint64_t seed) {
  WallOptions<D> wall{.name = given.text("name"), .offset = given.real("offset"), .one_sided = given.flag("one_sided")};
  wall.one_way = given.flag("one_way");
  const auto refuse = [&](const std::string& what, const std::string& remedy) {
    throw Error(Failure::deck, "the wall '" + wall.name + "' " + what + "; " + remedy);
  };
  const auto vector = [&](std::string_view key, Vec<D>& to) {
    const auto* const numbers = given.find<std::vector<double>>(key);
    if (!numbers) return false;
    if (numbers->size() != D)
      refuse("has " + std::string(key == "axis" ? "an " : "a ").append(key) + " of " + std::to_string(numbers->size()) +
                 " numbers",
             "give " + std::to_string(D));
    to = Eigen::Map<const Vec<D>>(numbers->data());
    return true;
  };
  vector("normal", wall.normal);
  const std::string& shape = given.text("shape");
  const bool cylinder = shape == "cylinder";
  if (cylinder && D == 2) refuse("is a cylinder in two dimensions", "give shape = \"sphere\", which is a circle there");
  const bool has_centre = vector("centre", wall.centre), has_axis = vector("axis", wall.direction);
  const auto* const radius = given.find<double>("radius");
  wall.inside = given.flag("inside");
  if (shape == "plane" && (has_centre || has_axis || radius || !wall.inside))
    refuse("is a plane and has keys of a round wall",
           "give shape = \"sphere\" or \"cylinder\", or leave centre, axis, radius and inside out");
  if (shape != "plane" && !(has_centre && radius))
    refuse("is a " + shape + " without " + (radius ? "centre" : "radius"), "give centre and radius");
  if (has_axis != cylinder || (cylinder && wall.direction.isZero(0)))
    refuse(cylinder ? "is a cylinder without an axis" : "is a " + shape + " and has an axis",
           cylinder ? "give axis, a vector along it that is not zero" : "leave axis out, or give shape = \"cylinder\"");
  if (radius) wall.round = *radius;
  wall.seed = seed;
  if (const auto* own = given.find<std::int64_t>("seed")) wall.seed = static_cast<std::uint64_t>(*own);
  if (const auto* temperature = given.find<double>("temperature")) wall.temperature = *temperature;
  if (const auto* speed = given.find<double>("velocity")) wall.velocity = *speed;
  if (const auto* shaken = given.find<TableValue>("velocity")) {
    wall.amplitude = std::get<double>(shaken->at("amplitude"));
    wall.frequency = std::get<double>(shaken->at("frequency"));
  }
  wall.moved = given.real("moved");
  if (const auto* until = given.find<double>("until")) wall.until = *until;
  wall.turns = given.real("phase");
  box.add(std::move(wall));
}

template <int D>
std::string no_room(const Box<D>& box, double diameter) {
  const auto all = box.walls();
  for (const Wall<D>& wall : all)
    if (wall.round > 0 && wall.inside && diameter > 0 && 2 * wall.round <= diameter + box.gap_tolerance()(diameter))
      return box.wall_name(wall.number) + " has the diameter " + short_text(2 * wall.round) +
             " and no room for a diameter of " + short_text(diameter) + " inside; enlarge it";
  for (std::size_t i = 0; i < all.size(); ++i)
    for (std::size_t j = i + 1; j < all.size(); ++j) {
      const Wall<D>&one = all[i], &other = all[j];
      if (one.round > 0 || other.round > 0) continue;
      const bool front_and_rear = one.number >= 2 * D && box.find(one.number) == box.find(other.number);
      const bool facing = (one.normal + other.normal).norm() < 1e-6;
      const double gap = -(one.level(0) + other.level(0));
      if (front_and_rear || !facing || one.one_way || other.one_way ||
          (diameter > 0 && !(one.one_sided && other.one_sided)))
        continue;
      if (gap > 0 && gap >= diameter - box.gap_tolerance()(diameter)) continue;
      return box.wall_name(one.number) + " and " + box.wall_name(other.number) + " leave no room " +
             (diameter > 0 ? "for a diameter of " + short_text(diameter) + " " : "") + "between them at time " +
             short_text(box.time) + "; move them apart, or end the run before they meet";
    }
  return {};
}

template std::string no_room(const Box<2>&, double);
template std::string no_room(const Box<3>&, double);
template void add_wall(Box<2>&, const Parameters&, std::uint64_t);
template void add_wall(Box<3>&, const Parameters&, std::uint64_t);

}  // namespace carom
