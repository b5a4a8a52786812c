// SPDX-License-Identifier: BSD-3-Clause
#include "engine/laws/contact_options.h"

namespace carom {

const std::vector<Parameter>& contact_parameters() {
  using enum Parameter::Type;
  using Range = Parameter::Range;
  static const std::vector<Parameter> all = [] {
    Parameter restitution{"restitution", real_or_table, "1.0", "-",
                          "e, the fraction of the normal speed that the contact gives back; or { form = \"power\", "
                          "v0, exponent }: the power law e = min(1, (v/v0)^-exponent) of the approach speed v"};
    restitution.range = Range::non_negative;
    restitution.most = 1;
    restitution.keys = {{"form", text, "", "-", "of the law", Range::any, {"power"}},
                        {"v0", real, "", "length/time", "the largest approach speed that is elastic", Range::positive},
                        {"exponent", real, "", "-", "0.234 for ice of planetary rings", Range::positive}};
    Parameter tangential{"tangential", real, "none", "-",
                         "makes the spheres rough: the tangential velocity of the surfaces times -tangential is what "
                         "the contact leaves; -1 smooth, 0 they stick, 1 perfectly rough. Spheres then have a spin"};
    tangential.most = 1;
    return std::vector<Parameter>{
        {"between", text_list, "", "-",
         "two species, or a species and a wall (x-, x+, … or its name); \"*\": all species and all walls"},
        restitution,
        tangential,
        {"friction", real, "none", "-",
         "the largest tangential impulse over the normal one (Coulomb); no limit where absent", Range::non_negative},
        {"rest_speed", real, "none", "length/time",
         "slower approaches end at rest in methods with steps and are elastic in free flight. Where absent: 1e-8 of "
         "the "
         "thermal speed; in methods with steps the speed sqrt(1e-4 a sigma) of a fall from half of 1e-4 contact "
         "distances sigma if that is faster, where a is the larger of the accelerations that forces give to the two "
         "partners, less the acceleration at which forces part them",
         Range::non_negative}};
  }();
  return all;
}

template <int D>
void add_contact(Box<D>& box, std::span<const std::string> species, const Parameters& given) {
  const auto& between = given.get<std::vector<std::string>>("between");
  const auto refuse = [](const std::string& what, const std::string& remedy) {
    throw Error(Failure::deck, what + "; " + remedy);
  };
  if (between.size() != 2)
    refuse("a contact is between two partners, 'between' names " + std::to_string(between.size()),
           "give two species, or a species and a wall");
  ContactLaw law;
  if (const auto* e = given.find<double>("restitution")) law.restitution = *e;
  if (const auto* power = given.find<TableValue>("restitution")) {
    law.v0 = std::get<double>(power->at("v0"));
    law.exponent = std::get<double>(power->at("exponent"));
  }
  if (const auto* beta = given.find<double>("tangential")) law.tangential = *beta;
  if (law.tangential && *law.tangential < -1)
    refuse("'tangential' must be at least -1 (is " + short_text(*law.tangential) + ")",
           "give a number from -1, smooth, to 1, perfectly rough");
  if (const auto* mu = given.find<double>("friction")) law.friction = *mu;
  if (given.has("friction") && !given.has("tangential"))
    refuse("'friction' without 'tangential'", "give both, for instance tangential = 0.0: surfaces that stick");
  if (const auto* speed = given.find<double>("rest_speed")) law.rest_speed = *speed;

  const std::vector<Wall<D>> walls = box.walls();
  const std::size_t numbers = walls.empty() ? 0 : walls.back().number + std::size_t{1};
  box.contacts.resize(species.size(), numbers);
  // The partners that a name stands for: species, or walls by number.
  const auto find_species = [&](const std::string& name) {
    std::vector<std::size_t> found;
    for (std::size_t k = 0; k < species.size(); ++k)
      if (name == "*" || name == species[k]) found.push_back(k);
    return found;
  };
  const auto find_walls = [&](const std::string& name) {
    std::vector<Id> found;
    for (const Wall<D>& wall : walls)
      if (name == "*" || name == box.name_of(wall.number)) found.push_back(wall.number);
    return found;
  };
  const auto one = find_species(between[0]), other = find_species(between[1]);
  const auto one_wall = find_walls(between[0]), other_wall = find_walls(between[1]);
  for (const auto& [name, is_species, is_wall] :
       {std::tuple{between[0], !one.empty(), !one_wall.empty()}, {between[1], !other.empty(), !other_wall.empty()}})
    if (!is_species && !is_wall) {
      std::string known;
      for (const std::string& each : species) known += each + ", ";
      for (const Wall<D>& wall : walls) known += box.name_of(wall.number) + ", ";
      refuse("'" + name + "' is neither a species nor a wall", "give one of: " + known + "*");
    }
  if (one.empty() && other.empty())
    refuse("'" + between[0] + "' and '" + between[1] + "' are both walls", "give at least one species");
  const std::uint16_t number = box.contacts.add(law);
  for (const std::size_t a : one)
    for (const std::size_t b : other) box.contacts.set_pair(a, b, number);
  for (const std::size_t a : one)
    for (const Id wall : other_wall) box.contacts.set_wall(a, wall, number);
  for (const std::size_t b : other)
    for (const Id wall : one_wall) box.contacts.set_wall(b, wall, number);
}

void check_inertia(double inertia, int dimension) {
  const double most = ContactLaws::largest_inertia(dimension);
  if (inertia > 0 && inertia <= most) return;
  throw Error(Failure::deck,
              "'inertia' is " + short_text(inertia) +
                  (inertia > 0 ? ", more than the " + short_text(most) + (dimension == 2 ? " of a ring" : " of a shell")
                               : ", not positive") +
                  "; give 4I/(m sigma^2), sigma the diameter; a homogeneous body has " +
                  short_text(ContactLaws::homogeneous(dimension)));
}

template void add_contact(Box<2>&, std::span<const std::string>, const Parameters&);
template void add_contact(Box<3>&, std::span<const std::string>, const Parameters&);

}  // namespace carom
