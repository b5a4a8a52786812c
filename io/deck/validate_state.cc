// SPDX-License-Identifier: BSD-3-Clause
#include "io/deck/validate_state.h"

#include <algorithm>
#include <limits>
#include <numbers>
#include <sstream>

#include "engine/forces/forces.h"
#include "engine/forces/stiffness.h"
#include "engine/setup/initial_state.h"

namespace carom {
namespace {

/// Text with enough digits to distinguish a distance from a contact distance.
template <class... Items>
std::string say(const Items&... items) {
  std::ostringstream text;
  text.precision(15);
  (text << ... << items);
  return text.str();
}

std::string plural(std::size_t n, const std::string& one, const std::string& many) {
  return std::to_string(n) + " " + (n == 1 ? one : many);
}

template <int D>
void check_box(const Deck::Source& source, const System<D>& system, Problems& problems) {
  const auto radius = system.decomposition.radii();
  const auto [smallest, largest] = std::ranges::minmax(radius);
  const double diameter = 2 * largest, rounded = system.box.gap_tolerance()(0);
  constexpr double kDeepest = 1e-6;  // [contact distance], an overlap that ends the run
  if (rounded > kDeepest * smallest)
    problems.error(source.box,
                   say("distances in a box of ", short_text(system.box.edges.maxCoeff()), " are known to ",
                       short_text(rounded, 2), " only, and the smallest radius is ", short_text(smallest)),
                   "shorten the longest edge; the rounding of positions would make spheres overlap");
  for (int k = 0; k < D; ++k) {
    const double edge = system.box.edges[k];
    if (!system.box.periodic(k) || edge >= diameter - system.box.gap_tolerance()(diameter)) continue;
    problems.error(source.box,
                   say("the periodic box is ", edge, " long on axis ", k, ", less than a diameter of ", diameter),
                   "enlarge the box; a sphere must not touch itself");
  }
  const double filled =
      packing_fraction<D>(system.box.volume(), system.particles.radius, system.decomposition.others());
  if (filled > 1 && system.box.closed())
    problems.error(source.box, say("the spheres fill ", filled, " of the box"),
                   "enlarge the box or take fewer spheres");
}

template <int D>
void check_spheres(const Deck::Source& source, const System<D>& system, Problems& problems) {
  if (const Outsiders out = find_outsiders(system); out.spheres > 0)
    problems.error(place_of(source, out.worst),
                   say(plural(out.spheres, "sphere is", "spheres are"), " not inside the walls; the worst is particle ",
                       out.worst, ", which reaches ", out.depth, " beyond ", system.box.wall_name(out.wall)),
                   "move it inside (at least a radius from every wall), or enlarge the box");
  if (const Overlaps overlaps = find_overlaps(system); overlaps.pairs > 0)
    problems.error(place_of(source, overlaps.hi),
                   say(plural(overlaps.pairs, "pair of spheres overlaps", "pairs of spheres overlap"),
                       "; the worst is particles ", overlaps.lo, " and ", overlaps.hi, " at distance ",
                       overlaps.distance, ", contact distance ", overlaps.contact),
                   "move them apart, make the radii smaller or the box larger");
}

/// A rescaling bath multiplies velocities, so that particles at rest stay there unless something else moves them.
template <int D>
void check_bath(const Deck::Source& source, const System<D>& system, Problems& problems) {
  const Bath& bath = system.box.bath;
  if (!bath.rescales() || !system.interactions.empty() || std::max(bath.temperature, bath.last_temperature) == 0 ||
      std::ranges::any_of(system.box.options, [](const auto& wall) { return wall.moves(); }))
    return;
  auto moving = static_cast<std::uint64_t>(
      std::ranges::count_if(system.particles.v, [](const Vec<D>& v) { return v != Vec<D>::Zero(); }));
  system.decomposition.ranks().sum({&moving, 1});
  if (moving == 0)
    problems.error(source.values.find("bath")->at,
                   "a rescaling bath multiplies velocities, and all particles are at rest",
                   "give the particles a temperature above 0, or take type = \"andersen\"");
}

/// The longest bond of an interaction [length]; infinite: too long for a periodic box. Collective.
template <int D>
double longest_bond(const Interaction<D>& term, const System<D>& system) try {
  const auto& p = system.particles;
  if (!system.decomposition.joined()) return term.reach(p.x);
  Communicator& ranks = system.decomposition.ranks();
  double longest = term.reach(p, ranks);
  ranks.largest({&longest, 1});
  return longest;
} catch (const Error&) {
  return std::numeric_limits<double>::infinity();
}

/// In equilibrium the energy E of a spring exceeds x kT with the probability erfc(√x). For x = 32 this is 1.2e-15, so
/// that one in a million states of 10⁹ bonds has such a bond.
constexpr double kMostOfBond = 32;  // [kT]

/// Bonds so stretched that they would heat the particles.
template <int D>
void check_bonds(const Deck::Source& source, const System<D>& system, Problems& problems) {
  const bool cooled = system.box.bath.type != Bath::Type::none;
  double temperature = cooled ? system.box.bath.temperature : 0;
  for (const SpeciesConfig& species : source.species)
    temperature = std::max(temperature, species.temperature.value_or(0));
  const PlacementConfig& placement = source.placement;
  const bool placed = !placement.type.empty() && placement.type != "file" &&
                      std::ranges::any_of(source.species, &SpeciesConfig::placed);
  for (std::size_t n = 0; n < system.interactions.size() && temperature > 0; ++n) {
    const InteractionConfig& config = source.interactions[n];
    if (config.info->kind != InteractionInfo::Kind::bonded) continue;
    const double longest = longest_bond(*system.interactions[n], system),
                 beyond = longest - config.parameters.real("rest_length");
    const double energy = 0.5 * config.parameters.real("stiffness") * beyond * beyond;
    if (!(beyond > 0 && energy > kMostOfBond * temperature)) continue;
    const std::string length = std::isinf(longest) ? "half an edge of the periodic box or more" : say(longest);
    const std::string what =
        say("the longest bond is ", length, " long, its rest length is ", config.parameters.real("rest_length"), ": ",
            std::isinf(longest) ? "" : say("its energy is ", short_text(energy / temperature, 3), " kT, and "),
            "a bond in equilibrium has not more than ", kMostOfBond, " kT");
    if (placed && (!cooled || std::isinf(longest)))
      problems.error(placement.at, "type = \"" + placement.type + "\" does not look at bonds: " + what,
                     placement.lattice()
                         ? "take a count that fills the lattice and a chain_length that divides its rows, at a "
                           "distance near rest_length, or type = \"file\""
                         : "give positions by type = \"file\", or take a lattice whose rows are the chains");
    else if (!std::isinf(longest))
      problems.warning(config.at, what, "the bonds will heat the particles; start with bonds near their rest length");
  }
}

}  // namespace

const Place& place_of(const Deck::Source& source, Id id) {
  const SpeciesConfig* config = source.species.data();
  for (std::size_t end = config->count; end <= id; end += config->count) ++config;
  return config->placed ? source.placement.at : config->at;
}

template <int D>
void check_state(const Deck& deck, const System<D>& system, Problems& problems, bool fresh) {
  const Deck::Source& source = *deck.source;
  check_bath(source, system, problems);
  if (fresh) check_bonds(source, system, problems);
  if (!source.integrator->hard_cores) return;
  check_box(source, system, problems);
  if (problems.errors() == 0) check_spheres(source, system, problems);
  if (const std::string problem = problems.errors() == 0 ? step_problem(system) : ""; !problem.empty())
    problems.error(source.values.list("step").front().at, problem);
}

template <int D>
double shortest_period(const System<D>& system) {
  return 2 * std::numbers::pi / std::sqrt(largest_squared_frequency(system));
}

/// The number of pairs on all ranks if the particles were evenly distributed and all had the longest reach of any term;
/// 0 in an open box. Collective.
template <int D>
double pairs_at_mean_density(const System<D>& system) {
  if (!system.box.closed()) return 0;
  double reach = 0;
  for (const auto& term : system.interactions)
    reach = std::max(reach, system.decomposition.joined() ? term->reach(system.particles, system.decomposition.ranks())
                                                          : term->reach(system.particles.x));
  reach = system.decomposition.largest(reach);  // that of bonds is known on the ranks that have them
  const double n = static_cast<double>(system.size());
  const double ball = D == 2 ? std::numbers::pi * reach * reach : 4.0 / 3 * std::numbers::pi * reach * reach * reach;
  return 0.5 * n * n * (std::isfinite(reach) ? ball / system.box.volume() : 1);
}

template <int D>
void warn_of_state(const Deck& deck, System<D>& system, Problems& problems) {
  const Deck::Source& source = *deck.source;
  const Box<D>& box = system.box;
  if (!source.integrator->hard_cores && box.has_walls())
    problems.warning(source.system, "walls do not act with " + deck.integrator + ", which knows no hard cores",
                     "make the boundary open or periodic, or take another integrator");

  const double close_packing = D == 2 ? std::numbers::pi / std::sqrt(12.0) : std::numbers::pi / std::sqrt(18.0);
  const double filled = packing_fraction<D>(box.volume(), system.particles.radius, system.decomposition.others());
  if (source.integrator->hard_cores && box.closed() && filled > close_packing)
    problems.warning(source.box,
                     say("packing fraction ", filled, " is beyond close packing of equal spheres, ", close_packing),
                     "check box and radii");

  double shortest = std::numeric_limits<double>::infinity();
  for (int k = 0; k < D; ++k)
    if (box.periodic(k)) shortest = std::min(shortest, box.edges[k]);
  for (const InteractionConfig& config : source.interactions)
    if (config.parameters.has("cutoff") && config.parameters.real("cutoff") > shortest / 2)
      problems.warning(config.at,
                       say("cutoff ", config.parameters.real("cutoff"), " is more than half the box, ", shortest / 2),
                       "particles meet several images of each other, as in a crystal; enlarge the box for a fluid");

  for (std::size_t k = 0; k < system.interactions.size(); ++k)
    if (const auto caution = system.interactions[k]->caution(); !caution.what.empty())
      problems.warning(source.interactions[k].at, caution.what, caution.remedy);

  constexpr std::uint64_t affordable = 500'000;  // particles or pairs: below a second of work
  if (!source.integrator->stepping || deck.plan.accuracy > 0 || system.interactions.empty() ||
      system.size() > affordable || pairs_at_mean_density(system) > affordable)
    return;
  system.quanta = quanta(system);
  system.decomposition.divide(true, deck.plan.step);
  std::uint64_t pairs = 0;
  for (const auto& term : system.interactions) pairs += term->interacting_pairs(system.particles.x);
  system.decomposition.ranks().sum({&pairs, 1});
  const double period = pairs <= affordable ? shortest_period(system) : std::numeric_limits<double>::infinity();
  system.decomposition.to_blocks();
  if (deck.plan.step > period / 10)
    problems.warning(source.step,
                     say("step ", deck.plan.step, " is long for the shortest period at the start, ", period),
                     "a tenth of that period or less is usual");
}

template void check_state(const Deck&, const System<2>&, Problems&, bool);
template double shortest_period(const System<2>&);
template void warn_of_state(const Deck&, System<2>&, Problems&);

template void check_state(const Deck&, const System<3>&, Problems&, bool);
template double shortest_period(const System<3>&);
template void warn_of_state(const Deck&, System<3>&, Problems&);

}  // namespace carom
