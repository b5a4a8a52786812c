// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "engine/forces/pair_filter.h"
#include "engine/laws/bath_options.h"
#include "engine/laws/contact_options.h"
#include "engine/laws/wall_options.h"
#include "engine/ranks/id_blocks.h"
#include "engine/run/step_choice.h"
#include "engine/setup/epoch.h"
#include "engine/setup/placement.h"
#include "engine/setup/step_options.h"
#include "io/deck/deck_source.h"
#include "io/deck/memory.h"
#include "io/deck/validate_state.h"

namespace carom {
namespace {

/// Masses, radii and charges; only of this rank's block, if there are `ranks` and built_in_blocks() is true.
template <int D>
void fill_particles(const Deck::Source& source, System<D>& system, Communicator* ranks) {
  Particles<D>& all = system.particles;
  std::size_t begin = 0, end = source.particles();  // ids of this rank
  if (ranks && built_in_blocks(source)) {
    Sizes sizes;
    sizes.spheres = end;
    sizes.by_species = true;
    for (const SpeciesConfig& species : source.species) {
      sizes.radius.push_back(species.radius[0]);
      sizes.mass.push_back(species.mass[0]);
      sizes.number.push_back(static_cast<double>(species.count));
    }
    system.decomposition.join(*ranks, std::move(sizes));
    const IdBlocks blocks = system.decomposition.blocks();
    begin = blocks.first(ranks->rank());
    end = blocks.first(ranks->rank() + 1);
    for (std::size_t id = begin; id < end; ++id) all.id.push_back(static_cast<Id>(id));
  }
  std::size_t first = 0;  // id of the species
  std::uint16_t index = 0;
  for (const SpeciesConfig& species : source.species) {
    for (std::size_t id = std::max(begin, first); id < std::min(end, first + species.count); ++id) {
      all.mass.push_back(SpeciesConfig::of(species.mass, id - first));
      all.radius.push_back(SpeciesConfig::of(species.radius, id - first));
      all.charge.push_back(SpeciesConfig::of(species.charge, id - first));
      all.species.push_back(index);
    }
    first += species.count;
    ++index;
  }
  const std::size_t n = all.mass.size();
  all.x.assign(n, Vec<D>::Zero());
  all.v.assign(n, Vec<D>::Zero());
  all.image.assign(n, Image<D>{});
}

/// Wraps all particles into the periodic box. Throws Error(Failure::initial_state).
template <int D>
void wrap_all(const Deck::Source& source, System<D>& system) {
  Particles<D>& p = system.particles;
  for (Id i = 0; i < p.size(); ++i) try {
      system.box.wrap(p.x[i], p.image[i]);
    } catch (const Error&) {
      Problems problems;
      problems.error(place_of(source, p.id_of(i)),
                     "particle " + std::to_string(p.id_of(i)) + " is more than 2147483647 periodic boxes away, and " +
                         "boxes are counted with 32 bits",
                     "give a position in the box, [0, edge) along each axis, or near it");
      problems.throw_errors(Failure::initial_state);
    }
}

/// Velocities and spins as given, or drawn for the species that have a temperature of them.
template <int D>
void give_motion(const Deck::Source& source, System<D>& system) {
  std::vector<Id> drawn, turning;
  std::vector<double> temperature, rotational_temperature;
  Particles<D>& p = system.particles;
  std::size_t first = 0;  // id of the species
  Id i = 0;
  for (const SpeciesConfig& species : source.species) {
    for (; i < p.size() && p.id_of(i) < first + species.count; ++i) {
      if (!species.velocity.empty()) p.v[i] = Eigen::Map<const Vec<D>>(species.velocity[p.id_of(i) - first].data());
      if (!species.spin.empty()) p.spin[i] = Eigen::Map<const Spin<D>>(species.spin[p.id_of(i) - first].data());
      if (species.temperature) drawn.push_back(i), temperature.push_back(*species.temperature);
      if (species.rotational_temperature)
        turning.push_back(i), rotational_temperature.push_back(*species.rotational_temperature);
    }
    first += species.count;
  }
  draw_velocities<D>(p, drawn, temperature, source.placement.seed, RandomPurpose::velocity,
                     system.decomposition.others());
  if (system.box.contacts.rough())
    draw_spins<D>(p, system.box.contacts, turning, rotational_temperature, source.placement.seed,
                  system.decomposition.others());
}

/// Writes the values that depend on the initial state into the deck. Reports parameters of [output] that are not valid
/// in this box.
template <int D>
void complete_values(Deck& deck, System<D>& system, const GivenState* given, Problems& problems) {
  Deck::Source& source = *deck.source;
  if (source.edges.empty()) {
    source.edges.assign(system.box.edges.begin(), system.box.edges.end());
    source.values.find("system")->values.set("box", source.edges);
    source.values.find("placement")->values.erase("packing_fraction");
  }
  if (ValueTable* placement = source.values.find("placement"); placement != nullptr && !source.placement.file.empty())
    placement->values.set("file", source.placement.file.string());
  if (source.placement.type == "random" && !source.integrator->hard_cores && !source.placement.distance)
    source.values.find("placement")
        ->values.set("distance", default_distance<D>(source.particles(), system.box.volume()));
  if (deck.plan.step == 0) {
    choose_step(system, *source.integrator, deck.plan, deck.integrator_parameters);
    set_steps(deck.plan, deck.integrator_parameters);
    for (const auto& [name, value] : deck.integrator_parameters.all())
      source.values.find("integrator")->values.set(name, value);
  }
  if (Bath& bath = system.box.bath; bath.needs_ramp_time()) {
    const auto [start, end] = ramp_times(deck.plan, given ? given->steps : 0, given ? given->time : 0);
    source.values.find("bath")->values.set("ramp_time", std::vector{bath.ramp_start = start, bath.ramp_end = end});
  }
  ValueTable& output = *source.values.find("output");
  for (auto& [info, parameters] : deck.output.observables) {
    if (const auto wrong = info->complete(parameters, system))
      problems.error(output.place(output_key(*info, wrong->parameter)), wrong->what, wrong->remedy);
    for (const auto& [name, value] : parameters.all()) output.values.set(output_key(*info, name), value);
  }
  deck.toml_text = write_deck(source.values);
}

/// Gives the bonds found in the initial state to the interactions that search for them there.
void take_bonds(Deck::Source& source, const std::vector<PairList>& bonds) {
  std::size_t n = 0;
  for (InteractionConfig& config : source.interactions)
    if (config.parameters.has("within") && n < bonds.size()) {
      config.parameters.erase("within");
      config.parameters.set("pairs", bonds[n++]);
    }
}

template <int D>
InteractionContext<D> context_of(const Deck::Source& source, const System<D>& system, bool placed) {
  return {.box = system.box,
          .particles = system.particles,
          .species = system.species,
          .placed = placed,
          .total = source.particles(),
          .ranks = system.decomposition.others()};
}

/// Adds the steps of pairs that are near each other in the initial state. The resolved deck lists these pairs, so that
/// a run that goes on has them.
template <int D>
void bond_near(Deck::Source& source, System<D>& system, Problems& problems) {
  for (ValueTable& step : source.values.list("step")) {
    if (!step.values.has("within")) continue;
    try {
      find_step_bonds<D>(step.values, context_of(source, system, true));
      add_step<D>(system.box, system.species, source.particles(), step.values);
    } catch (const Error& e) {
      problems.error(step.at, e.what());
    }
  }
}

}  // namespace

bool built_in_blocks(const Deck::Source& source) {
  return source.placement.lattice() && std::ranges::all_of(source.species, [](const SpeciesConfig& species) {
           return species.placed && species.radius.size() == 1 && species.mass.size() == 1;
         });
}

template <int D>
void fill_box(const Deck::Source& source, System<D>& system) {
  std::copy_n(source.boundary.begin(), D, system.box.boundary.begin());
  if (!source.edges.empty()) std::copy_n(source.edges.begin(), D, system.box.edges.begin());
  system.box.shear_rate = source.shear_rate;
  system.box.shear_rates = source.shear_rates;
  system.box.begin_step(0, 0);
  system.box.tilt = source.tilt;
  for (const ValueTable& wall : source.values.list("wall"))
    if (!wall.wrong) add_wall(system.box, wall.values, source.placement.seed);
  for (const ValueTable& bath : source.values.list("bath"))
    if (!bath.wrong) system.box.bath = bath_of(bath.values, source.placement.seed);
  system.species.clear();
  for (const SpeciesConfig& species : source.species) {
    system.species.push_back(species.name);
    system.box.contacts.inertias.push_back(species.inertia);
  }
  for (const ValueTable& contact : source.values.list("contact"))
    if (!contact.wrong) add_contact<D>(system.box, system.species, contact.values);
  for (const ValueTable& step : source.values.list("step"))
    if (!step.wrong) add_step<D>(system.box, system.species, source.particles(), step.values);
}

template <int D>
void make_interactions(const Deck::Source& source, System<D>& system, bool placed, Problems& problems) {
  InteractionContext<D> context = context_of(source, system, placed);
  const auto bonded = [](const InteractionConfig& config) {
    return config.info->kind == InteractionInfo::Kind::bonded;
  };
  std::vector<std::unique_ptr<Interaction<D>>> terms(source.interactions.size());
  const bool fixed = std::ranges::any_of(source.species, &SpeciesConfig::fixed);
  const auto make = [&](std::size_t n) {
    const InteractionConfig& config = source.interactions[n];
    if (config.wrong) return;
    try {
      auto term = config.info->make<D>(config.parameters, context);
      if (source.integrator != nullptr)
        if (const std::string no = source.integrator->refusal(*term, fixed); !no.empty())
          throw Error(Failure::deck, no);
      terms[n] = std::move(term);
    } catch (const Error& e) {
      const std::string message = e.what();
      problems.error(config.at, message.find("; ") < message.size() ? message : message + "; see `carom schema`");
    }
  };
  const auto& all = source.interactions;  // bonds before the terms that leave out bonded pairs
  for (std::size_t n = 0; n < all.size(); ++n)
    if (bonded(all[n])) make(n);
  context.bonds = bonds_of(terms, system.box.steps);
  const bool later =
      std::ranges::any_of(all, bonded) ||
      std::ranges::any_of(source.values.list("step"), [](const auto& step) { return step.values.has("within"); });
  if (!context.bonds && later) context.bonds = std::make_shared<BondTable>(PairList());
  for (std::size_t n = 0; n < all.size(); ++n)
    if (!bonded(all[n])) make(n);
  for (auto& term : terms)
    if (term) system.interactions.push_back(std::move(term));
}

template <int D>
std::vector<PairList> found_bonds(const Deck& deck, const System<D>& system) {
  std::vector<PairList> found;
  const auto& all = deck.source->interactions;
  for (std::size_t n = 0; n < all.size(); ++n) {
    const PairList* bonds = system.interactions[n]->bonds();
    if (bonds != nullptr && all[n].parameters.has("within")) found.push_back(*bonds);
  }
  return found;
}

template <int D>
std::unique_ptr<System<D>> build_system(Deck& deck, Communicator* ranks, const GivenState* given, const Pause& pause) {
  const Deck::Source& source = *deck.source;
  if (deck.dimension != D) throw std::logic_error("build_system: the deck has another dimension");
  auto system = std::make_unique<System<D>>();
  fill_box(source, *system);
  const int share = ranks ? ranks->size() : 1;
  check_memory(source, source.edges.empty() ? nullptr : &system->box, share);
  fill_particles(source, *system, ranks);
  system->need_spins();
  if (given) {
    if (ranks && !system->decomposition.joined()) system->decomposition.join(*ranks);
    restore_particles(*system, given->read);
    if (system->box.contacts.rough()) system->particles.spin.resize(system->particles.size(), Spin<D>::Zero());
    take_bonds(*deck.source, given->bonds);
    system->box.begin_step(given->time, 0);
  } else {
    place_particles(source, *system, pause);
    check_memory(source, &system->box, share);
    wrap_all(source, *system);
    give_motion(source, *system);
  }

  Problems problems;
  bond_near(*deck.source, *system, problems);
  make_interactions(source, *system, true, problems);
  const bool fixed = std::ranges::any_of(source.species, &SpeciesConfig::fixed);
  if (const std::string no = source.integrator->refusal_of_shear(*system, fixed); !no.empty())
    problems.error(source.shear, no);
  else if (const std::string other =
               shear_problem(*system, deck.plan.end_time,
                             source.integrator->stepping && !given && deck.plan.accuracy == 0 ? deck.plan.step : 0);
           !other.empty())
    problems.error(source.shear, other);
  problems.throw_errors(Failure::deck);
  if (given && !given->branch) return system;
  complete_values(deck, *system, given, problems);
  problems.throw_errors(Failure::deck);
  check_state(deck, *system, problems, given == nullptr);
  problems.throw_errors(Failure::initial_state);
  if (ranks && !system->decomposition.joined()) system->decomposition.join(*ranks);
  warn_of_state(deck, *system, problems);
  for (const std::string& warning : problems.warnings()) deck.warnings.push_back(warning);
  return system;
}

template void fill_box(const Deck::Source&, System<2>&);
template void make_interactions(const Deck::Source&, System<2>&, bool, Problems&);
template std::unique_ptr<System<2>> build_system<2>(Deck&, Communicator*, const GivenState*, const Pause&);
template std::vector<PairList> found_bonds(const Deck&, const System<2>&);

template void fill_box(const Deck::Source&, System<3>&);
template void make_interactions(const Deck::Source&, System<3>&, bool, Problems&);
template std::unique_ptr<System<3>> build_system<3>(Deck&, Communicator*, const GivenState*, const Pause&);
template std::vector<PairList> found_bonds(const Deck&, const System<3>&);

}  // namespace carom
