// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <functional>
#include <limits>

#include "engine/laws/bath_options.h"
#include "engine/laws/contact_options.h"
#include "engine/laws/wall_options.h"
#include "engine/run/step_choice.h"
#include "engine/setup/step_options.h"
#include "io/deck/deck_source.h"
#include "io/deck/options.h"

namespace carom {
namespace {

constexpr std::int64_t kMostParticles = 1'000'000'000;  // in a species; ids have 32 bits

/// "1 particle", "2 particles"
std::string count_of(std::size_t n, const std::string& what) {
  return std::to_string(n) + " " + what + (n == 1 ? "" : "s");
}

/// The parts of a deck in the order in which they build on each other.
class Interpreter {
 public:
  Interpreter(Deck& deck, const TextReader& reader, Problems& problems)
      : deck_(deck), source_(*deck.source), values_(source_.values), reader_(reader), problems_(problems) {}

  void all() {
    top();
    system();
    bath();
    for (const ValueTable& table : values_.list("particles")) species(table);
    try_walls();
    placement();
    integrator();
    cores();
    for (ValueTable& table : values_.list("interaction"))
      if (table.variant != nullptr) interaction(table);
    try_interactions();
    run();
    output();
  }

 private:
  void top() {
    const ValueTable& table = *values_.find("");
    if (const auto* format = table.find<std::int64_t>("format"); format != nullptr && *format != 1)
      problems_.error(table.place("format"), "unknown deck format " + std::to_string(*format),
                      "this version reads format 1");
    table.read<std::string>("title", deck_.title);
    table.read<std::string>("description", deck_.description);
  }

  void system() {
    const ValueTable* table = values_.find("system");
    if (table == nullptr) return;
    source_.system = table->at;
    source_.box = table->place("box");
    if (const auto* dimension = table->find<std::int64_t>("dimension")) {
      if (*dimension == 2 || *dimension == 3)
        dimension_ = static_cast<std::size_t>(*dimension);
      else
        problems_.error(table->place("dimension"), "'dimension' must be 2 or 3 (is " + std::to_string(*dimension) + ")",
                        "give one of the two");
    }
    deck_.dimension = static_cast<int>(dimension_);
    if (const auto* box = table->find<std::vector<double>>("box")) {
      source_.edges = *box;
      one_an_axis(*table, "box", box->size());
    }
    if (const auto* boundary = table->find<std::vector<std::string>>("boundary")) {
      one_an_axis(*table, "boundary", boundary->size());
      for (const std::string& name : *boundary) source_.boundary.push_back(find_boundary(name).boundary);
    }
    source_.shear = table->place("shear");
    if (const auto* shear = table->find<TableValue>("shear")) {
      const auto& rate = shear->at("rate");
      if (const auto* constant = std::get_if<double>(&rate)) source_.shear_rate = *constant;
      if (const auto* pairs = std::get_if<std::vector<std::vector<double>>>(&rate)) {
        for (const std::vector<double>& pair : *pairs)
          if (pair.size() == 2) source_.shear_rates.push_back({pair[0], pair[1]});
        const auto time = [](const std::array<double, 2>& each) { return each[0]; };
        const auto& rates = source_.shear_rates;
        if (pairs->empty() || rates.size() != pairs->size() || !(rates.front()[0] >= 0) ||
            !std::ranges::is_sorted(rates, std::less_equal(), time))
          problems_.error(source_.shear, "'rate' is no list of pairs with increasing times, the first at least 0",
                          "give a number, or [[time, rate], …]");
      }
    }
    if (table->read<double>("tilt", source_.tilt); table->given("tilt")) {
      if (!table->given("shear")) source_.shear = table->place("tilt");
      if (!(source_.tilt >= 0) || (!source_.edges.empty() && !(source_.tilt < source_.edges[0])))
        problems_.error(table->place("tilt"), "'tilt' is not between 0 and the edge along x", "add or take off edges");
    }
  }

  /// Adds walls, contacts and steps to a box, if enough is known about it.
  void try_walls() {
    const auto attempt = [&](auto box) {
      std::copy_n(source_.boundary.begin(), dimension_, box.boundary.begin());
      std::vector<std::string> names;
      for (const SpeciesConfig& species : source_.species) names.push_back(species.name);
      auto& walls = values_.list("wall");
      for (ValueTable& wall : walls)
        if (!wall.wrong) wall.wrong = report(wall.at, [&] { add_wall(box, wall.values); });
      for (ValueTable& contact : values_.list("contact"))
        if (!contact.wrong && !names.empty())
          contact.wrong = report(contact.at, [&] { add_contact(box, names, contact.values); });
      for (ValueTable& step : values_.list("step"))
        if (!step.wrong && !names.empty())
          step.wrong = report(step.at, [&] { add_step(box, names, source_.particles(), step.values); });
      if (source_.edges.size() != dimension_ || walls.empty()) return;
      std::copy_n(source_.edges.begin(), dimension_, box.edges.begin());
      report(walls.back().at, [&] { box.check(Failure::deck); });
    };
    if (source_.boundary.size() != dimension_) return;
    if (dimension_ == 2) attempt(Box<2>());
    if (dimension_ == 3) attempt(Box<3>());
  }

  void bath() {
    auto& all = values_.list("bath");
    for (ValueTable& each : all) {
      if (!each.wrong) each.wrong = report(each.at, [&] { bath_of(each.values); });
      if (&each != &all.front()) problems_.error(each.at, "a second [[bath]]", "give one; it acts on all particles");
    }
  }

  /// Reports the error that `work` throws, with the form "what; what to do", at this place; returns whether it throws.
  bool report(const Place& at, auto&& work) {
    try {
      work();
    } catch (const Error& e) {
      problems_.error(at, e.what());
      return true;
    }
    return false;
  }

  void one_an_axis(const ValueTable& table, const std::string& key, std::size_t size) {
    if (dimension_ != 0 && size != dimension_)
      problems_.error(table.place(key), "'" + key + "' has the wrong length (" + std::to_string(size) + ")",
                      "give " + std::to_string(dimension_) + ", one for each axis");
  }

  void species(const ValueTable& table) {
    SpeciesConfig species;
    species.at = table.at;
    table.read<std::string>("name", species.name);
    const bool named = table.find<std::string>("name") != nullptr;
    if (named && std::ranges::count(source_.species, species.name, &SpeciesConfig::name) > 0)
      problems_.error(table.place("name"), "two species are called '" + species.name + "'", "give each its own name");
    table.read<bool>("fixed", species.fixed);
    positions(table, species);
    velocities(table, species);
    spins(table, species);
    fixed(table, species);
    if (species.count > 0) {
      for (const char* key : {"display_radius", "radius"})
        if (table.given(key)) species.radius = numbers(table, key, species.count);
      if (species.radius.empty()) species.radius = {0.5};
      species.mass = numbers(table, "mass", species.count);
      species.charge = numbers(table, "charge", species.count);
      if (species.fixed) species.mass = {std::numeric_limits<double>::infinity()};
    }
    source_.species.push_back(std::move(species));
  }

  /// Spheres have a radius, and points have none. A list of frictions has one for each species.
  void cores() {
    if (const ValueTable* bath = values_.find("bath"))
      if (const auto* all = bath->find<std::vector<double>>("friction"); all && all->size() != source_.species.size())
        problems_.error(bath->place("friction"),
                        "'friction' has " + count_of(all->size(), "number") + " for " +
                            std::to_string(source_.species.size()) + " species",
                        "give one number for all, or one for each [[particles]] in their order");
    if (!source_.species.empty() && std::ranges::all_of(source_.species, &SpeciesConfig::fixed))
      problems_.error(source_.species.front().at, "all particles are fixed, and nothing would move",
                      "let some move: fixed = false");
    if (source_.integrator == nullptr) return;
    if (const ValueTable* step = values_.find("step"))
      report(step->at, [&] {
        if (const std::string no = source_.integrator->refusal_of_steps(); !no.empty()) throw Error(Failure::deck, no);
      });
    for (const ValueTable& step : values_.list("step"))
      report(step.at, [&] {
        if (source_.integrator->stepping && step.given("range") && !values_.list("contact").empty())
          throw Error(Failure::deck, std::string(steps_and_laws));
      });
    if (const ValueTable* placement = values_.find("placement")) {
      if (source_.integrator->hard_cores && placement->given("distance"))
        problems_.error(placement->place("distance"), "'distance' is for points, which only 'verlet' has",
                        "leave it out: spheres keep their diameters apart");
      if (!source_.integrator->hard_cores && source_.placement.type == "compressed")
        problems_.error(placement->place("type"),
                        "'" + deck_.integrator + "' treats particles as points, which cannot be compressed",
                        "take type = \"random\" or a lattice");
    }
    for (const ValueTable& table : values_.list("contact"))
      if (!source_.integrator->hard_cores && table.given("tangential"))
        problems_.error(table.place("tangential"),
                        "'" + deck_.integrator + "' treats particles as points, which do not touch",
                        "take psa or edda, where spheres collide, or leave the contact out");
    for (const ValueTable& table : values_.list("particles")) {
      if (source_.integrator->hard_cores && !table.given("radius"))
        problems_.error(table.at, "missing key 'radius' in [[particles]]", "give the radius of the hard core");
      if (source_.integrator->hard_cores && table.given("display_radius"))
        problems_.error(table.place("display_radius"), "'display_radius' is for points, which only 'verlet' has",
                        "leave it out: pictures show 'radius'");
      if (!source_.integrator->hard_cores && table.given("radius"))
        problems_.error(table.place("radius"),
                        "'" + deck_.integrator + "' treats particles as points and would ignore 'radius'",
                        "take psa or edda, where spheres collide, or write display_radius for the size in pictures");
    }
  }

  void positions(const ValueTable& table, SpeciesConfig& species) {
    const auto* position = table.find<std::vector<std::vector<double>>>("position");
    const auto* count = table.find<std::int64_t>("count");
    if (!table.given("position") && !table.given("count"))
      problems_.error(table.at, "missing key 'position' or 'count' in [[particles]]",
                      "give explicit positions, or a count for [placement] to place");
    if (table.given("position") && table.given("count"))
      problems_.error(table.place("count"), "'position' and 'count' exclude each other", "leave one of them out");
    if (position != nullptr) {
      species.position = *position;
      species.count = position->size();
      if (position->empty())
        problems_.error(table.place("position"), "'position' is empty", "give at least one vector");
      vectors(table, "position", *position);
    } else if (count != nullptr && *count > kMostParticles) {
      problems_.error(table.place("count"), "'count' is too large", "give at most " + std::to_string(kMostParticles));
    } else if (count != nullptr) {
      species.count = static_cast<std::size_t>(*count);
      species.placed = true;
    }
  }

  void velocities(const ValueTable& table, SpeciesConfig& species) {
    table.read<double>("temperature", species.temperature);
    if (const auto* velocity = table.find<std::vector<std::vector<double>>>("velocity")) {
      species.velocity = *velocity;
      if (species.count > 0 && velocity->size() != species.count && !species.placed)
        problems_.error(
            table.place("velocity"),
            "'velocity' has " + count_of(velocity->size(), "vector") + " for " + count_of(species.count, "particle"),
            "give one for each");
      vectors(table, "velocity", *velocity);
    }
    if (table.given("velocity") && table.given("temperature"))
      problems_.error(table.place("temperature"), "'velocity' and 'temperature' exclude each other",
                      "leave one of them out");
    else if (table.given("count") && table.given("velocity"))
      problems_.error(table.place("velocity"), "'velocity' goes with explicit positions only",
                      "give a temperature with a count");
    else if (table.given("count") && !table.given("temperature") && !species.fixed)
      problems_.error(table.at, "missing key 'temperature' in [[particles]]",
                      "a species given by count needs it; 0 leaves the particles at rest");
  }

  /// Fixed particles have no velocities and no spins.
  void fixed(const ValueTable& table, SpeciesConfig& species) {
    const auto still = [](const std::vector<double>& each) {
      return std::ranges::all_of(each, [](double c) { return c == 0; });
    };
    if (!species.fixed) return;
    for (const auto& [key, moves] : {std::pair{"velocity", !std::ranges::all_of(species.velocity, still)},
                                     {"temperature", species.temperature.value_or(0) > 0},
                                     {"spin", !std::ranges::all_of(species.spin, still)},
                                     {"rotational_temperature", species.rotational_temperature.value_or(0) > 0}})
      if (moves)
        problems_.error(table.place(key), std::string("'") + key + "' of fixed particles",
                        "leave it out, or let them move: fixed = false");
    species.temperature.reset();
    species.rotational_temperature.reset();
    species.velocity.clear();
    species.spin.clear();
  }

  void spins(const ValueTable& table, SpeciesConfig& species) {
    const auto* list = table.find<std::vector<std::vector<double>>>("spin");
    if (list != nullptr) {
      species.spin = *list;
      vectors(table, "spin", *list, dimension_ == 2 ? 1 : dimension_);
      if (species.placed)
        problems_.error(table.place("spin"), "'spin' goes with explicit positions only",
                        "give a rotational_temperature with a count");
      else if (species.count > 0 && list->size() != species.count)
        problems_.error(
            table.place("spin"),
            "'spin' has " + count_of(list->size(), "vector") + " for " + count_of(species.count, "particle"),
            "give one for each");
    }
    table.read<double>("rotational_temperature", species.rotational_temperature);
    if (table.given("spin") && table.given("rotational_temperature"))
      problems_.error(table.place("rotational_temperature"), "'spin' and 'rotational_temperature' exclude each other",
                      "leave one of them out");
    if (const auto* inertia = table.find<double>("inertia")) {
      species.inertia = *inertia;
      if (dimension_ != 0)
        report(table.place("inertia"), [&] { check_inertia(*inertia, static_cast<int>(dimension_)); });
    }
    const auto rough = [](const ValueTable& contact) { return contact.given("tangential"); };
    const auto& contacts = values_.list("contact");
    for (const char* key : {"spin", "rotational_temperature", "inertia"})
      if (table.given(key) && std::ranges::none_of(contacts, rough))
        problems_.error(table.place(key), std::string("'") + key + "' has no effect, all contacts are smooth",
                        "give a [[contact]] with 'tangential', or leave it out");
  }

  void vectors(const ValueTable& table, const std::string& key, const std::vector<std::vector<double>>& list) {
    vectors(table, key, list, dimension_);
  }
  void vectors(const ValueTable& table, const std::string& key, const std::vector<std::vector<double>>& list,
               std::size_t size) {
    for (std::size_t n = 0; n < list.size() && dimension_ != 0; ++n)
      if (list[n].size() != size)
        problems_.error(
            table.place(key),
            "vector " + std::to_string(n) + " (from 0) of '" + key + "' has " + count_of(list[n].size(), "number"),
            "system.dimension asks for " + std::to_string(size));
  }

  std::vector<double> numbers(const ValueTable& table, const std::string& key, std::size_t count) {
    if (const auto* number = table.find<double>(key)) return {*number};
    const auto* list = table.find<std::vector<double>>(key);
    if (list == nullptr) return {};
    if (list->size() != count)
      problems_.error(table.place(key),
                      "'" + key + "' has " + count_of(list->size(), "number") + " for " + count_of(count, "particle"),
                      "give one number for all, or one for each");
    return *list;
  }

  void placement() {
    PlacementConfig& placement = source_.placement;
    const auto& all = source_.species;
    const auto placed = [](const SpeciesConfig& s) { return s.placed; };
    const bool some = std::any_of(all.begin(), all.end(), placed), every = std::all_of(all.begin(), all.end(), placed);
    const ValueTable* table = values_.find("placement");
    const ValueTable* system = values_.find("system");
    if (table == nullptr) {
      if (some)
        problems_.error(std::find_if(all.begin(), all.end(), placed)->at,
                        "particles given by count, but no [placement]", "add the table with a type: " + join(types()));
    } else {
      placement.at = table->at;
      table->read<std::int64_t>("seed", placement.seed);
      if (const auto* fraction = table->find<double>("packing_fraction")) packing(*table, *fraction);
      if (table->variant != nullptr) placement.type = table->variant->name;
      if (!some && !all.empty() && !placement.type.empty())
        problems_.warning(table->at, "[placement] places no particles: all positions are explicit",
                          "leave it out, or give a species by count");
      const bool flat = placement.type == "hexagonal" || placement.type == "square";
      const bool deep = placement.type == "fcc" || placement.type == "simple-cubic";
      if ((flat && dimension_ == 3) || (deep && dimension_ == 2))
        problems_.error(table->place("type"),
                        "'" + placement.type + "' is a lattice of " + (flat ? "2" : "3") + " dimensions",
                        flat ? "take fcc or simple-cubic" : "take hexagonal or square");
      if ((flat || deep) && some && !every)
        problems_.error(table->place("type"), "a lattice cannot make room for explicit positions",
                        "take type = \"random\", or give all species by count");
      if (placement.type == "compressed") compressed(*table, some && !every);
      table->read<double>("distance", placement.distance);
      if (const auto* file = table->find<std::string>("file"))
        placement.file = std::filesystem::absolute(deck_.file.parent_path() / *file).lexically_normal();
    }
    if (system != nullptr && !system->given("box") && (table == nullptr || !table->given("packing_fraction")))
      problems_.error(system->at, "missing key 'box' in [system]",
                      "give the edges, or placement.packing_fraction to set them");
  }

  void compressed(const ValueTable& table, bool mixed) {
    PlacementConfig& placement = source_.placement;
    table.read<double>("growth_rate", placement.growth_rate);
    table.read<double>("max_collisions", placement.max_collisions);
    if (mixed)
      problems_.error(table.place("type"), "compression moves all particles, those with explicit positions too",
                      "take type = \"random\", or give all species by count");
    const auto& boundary = source_.boundary;
    if (std::find(boundary.begin(), boundary.end(), Boundary::open) != boundary.end())
      problems_.error(table.place("type"), "nothing is compressed in an open box",
                      "make the boundaries wall or periodic, or take type = \"random\"");
  }

  void packing(const ValueTable& table, double fraction) {
    source_.placement.packing_fraction = fraction;
    if (fraction >= 1)
      problems_.error(table.place("packing_fraction"), "'packing_fraction' must be below 1",
                      "spheres cannot fill a box");
    if (const ValueTable* system = values_.find("system"); system != nullptr && system->given("box"))
      problems_.error(table.place("packing_fraction"), "'packing_fraction' and system.box exclude each other",
                      "leave one of them out");
  }

  static std::vector<std::string> types() {
    std::vector<std::string> names;
    for (const Variant& variant : table_schema("placement").variants) names.push_back(variant.name);
    return names;
  }

  void integrator() {
    const ValueTable* table = values_.find("integrator");
    if (table == nullptr || table->variant == nullptr) return;
    deck_.integrator = table->variant->name;
    deck_.integrator_parameters = table->of_variant();
    source_.step = table->place("step");
    source_.integrator = &find_integrator(deck_.integrator);
    Plan& plan = deck_.plan;
    set_steps(plan, deck_.integrator_parameters);
    if (plan.longest_step != 0 && plan.longest_step < plan.step)
      problems_.error(table->place("longest_step"), "'longest_step' is shorter than 'step'",
                      "give a longer one, or none");
  }

  void interaction(ValueTable& table) {
    const std::size_t before = problems_.errors();
    if (table.variant->name == "table")
      if (const std::string wrong = read_points(table.values, deck_.file.parent_path(), reader_); !wrong.empty())
        problems_.error(table.place("file"), wrong);
    ids_exist(table);
    species_exist(table);
    source_.interactions.push_back({.info = &find_interaction(table.variant->name),
                                    .parameters = table.of_variant(),
                                    .at = table.at,
                                    .wrong = table.wrong || problems_.errors() > before});
  }

  void ids_exist(const ValueTable& table) {
    const std::size_t n = source_.particles();
    if (n == 0 || std::ranges::count(source_.species, 0u, &SpeciesConfig::count) > 0) return;  // an error of its own
    table.each_key([&](const Parameter& key) {
      const auto* pairs = table.find<PairList>(key.name);
      if (pairs == nullptr) return;
      for (const auto& pair : *pairs) {
        const std::string text = "[" + std::to_string(pair[0]) + ", " + std::to_string(pair[1]) + "]";
        for (const std::uint32_t id : pair)
          if (id >= n)
            problems_.error(table.place(key.name),
                            "pair " + text + " names particle " + std::to_string(id) + ", which is not there",
                            "there are " + count_of(n, "particle") + ", with ids from 0");
        if (pair[0] == pair[1])
          problems_.error(table.place(key.name), "pair " + text + " joins a particle to itself", "name two particles");
      }
    });
  }

  void species_exist(const ValueTable& table) {
    const auto* named = table.find<std::vector<std::string>>("species");
    if (named == nullptr) return;
    std::vector<std::string> known;
    for (const SpeciesConfig& species : source_.species) known.push_back(species.name);
    for (const std::string& name : *named)
      if (std::find(known.begin(), known.end(), name) == known.end())
        problems_.error(table.place("species"), "unknown species '" + name + "'", suggestion(name, known));
  }

  /// Makes the interactions for a system without positions, if enough is known about the particles and the box.
  void try_interactions() {
    const std::size_t axes = source_.boundary.size();
    const bool box = (dimension_ == 2 || dimension_ == 3) && axes == dimension_ &&
                     (source_.edges.empty() || source_.edges.size() == axes);
    const auto known = [](const SpeciesConfig& s) {
      return s.count > 0 && std::ranges::all_of(std::array{s.mass.size(), s.radius.size(), s.charge.size()},
                                                [&](std::size_t n) { return n == 1 || n == s.count; });
    };
    if (!box || source_.interactions.empty() || !std::ranges::all_of(source_.species, known)) return;
    const auto attempt = [&](auto&& system) {
      fill_box(source_, system);
      make_interactions(source_, system, false, problems_);
    };
    dimension_ == 2 ? attempt(System<2>()) : attempt(System<3>());
  }

  void run() {
    const ValueTable* table = values_.find("run");
    if (table == nullptr) return;
    table->read<std::int64_t>("steps", deck_.plan.steps);
    table->read<double>("end_time", deck_.plan.end_time);
    table->read<std::int64_t>("collisions", deck_.plan.collisions);
    for (const char* key : {"steps", "end_time", "collisions"})
      if (table->given(key) && !table->values.has(key)) return;  // a problem of its own
    const auto& baths = values_.list("bath");
    const auto ramp = std::ranges::find_if(baths, [](const ValueTable& bath) {
      return bath.find<std::vector<double>>("temperature") && !bath.values.has("ramp_time");
    });
    const EndlessRun why = endless(deck_.plan, source_.integrator, ramp != baths.end());
    if (why.what.empty()) return;
    problems_.error(why.cause == EndlessRun::Cause::run          ? table->at
                    : why.cause == EndlessRun::Cause::collisions ? table->place("collisions")
                                                                 : ramp->at,
                    why.what, why.remedy);
  }

  void output() {
    ValueTable* table = values_.find("output");
    if (table == nullptr) return;
    if (!table->given("directory"))
      table->values.set("directory", (std::filesystem::path("runs") / deck_.file.stem()).string());
    if (const auto* directory = table->find<std::string>("directory")) {
      deck_.output.directory = *directory;
      if (directory->empty()) problems_.error(table->place("directory"), "'directory' is empty", "name a folder");
    }
    table->read<double>("frame_interval", deck_.plan.frame_interval);
    table->read<double>("thermo_interval", deck_.plan.thermo_interval);
    table->read<double>("sample_start", deck_.output.sample_start);
    table->read<bool>("events", deck_.plan.events);
    table->read<bool>("overwrite", deck_.output.overwrite);
    if (const auto* start = table->find<std::string>("start"); start != nullptr && *start == "equilibrated") {
      deck_.plan.from_equilibrium = true;
      if (deck_.plan.thermo_interval == 0)
        problems_.error(table->place("start"),
                        "start = \"equilibrated\" looks at the rows of thermo.csv, and there are none",
                        "give a thermo_interval of a few mean free times");
    }
    for (const ObservableInfo& info : observables()) {
      Parameters parameters;
      for (const Parameter& each : info.parameters)
        if (const auto at = table->values.all().find(output_key(info, each.name)); at != table->values.all().end())
          parameters.set(each.name, at->second);
      if (parameters.has("interval") && parameters.real("interval") > 0)
        deck_.output.observables.push_back({&info, std::move(parameters)});
    }
    if (source_.placement.lattice() && !deck_.output.observables.empty() && deck_.output.sample_start == 0 &&
        !deck_.plan.from_equilibrium)
      problems_.warning(table->at, "the averages include the initial lattice, on which g(r) has sharp peaks",
                        "set sample_start to a time at which the lattice has melted, or start = \"equilibrated\"");
    if (const auto* units = table->find<TableValue>("units"))
      deck_.output.units = {std::get<std::string>(units->at("length")), std::get<std::string>(units->at("time"))};
    if (const auto* wall = table->find<std::string>("checkpoint_wall"); wall != nullptr && !wall->empty()) {
      deck_.output.checkpoint_wall = wall_seconds(*wall);
      if (!deck_.output.checkpoint_wall)
        problems_.error(table->place("checkpoint_wall"), "'" + *wall + "' is not a time",
                        "write hh:mm:ss, for instance 00:05:00");
    }
  }

  Deck& deck_;
  Deck::Source& source_;
  DeckValues& values_;
  const TextReader& reader_;
  Problems& problems_;
  std::size_t dimension_ = 0;  // 0: unknown
};

}  // namespace

std::string read_points(Parameters& table, const std::filesystem::path& folder, const TextReader& reader) {
  if (const auto* name = table.find<std::string>("file")) {
    if (table.has("r") || table.has("value"))
      return "'file' and the points themselves exclude each other; leave one of them out";
    const std::filesystem::path file = folder / *name;
    const auto text = reader(file);
    if (!text)
      throw Error(Failure::file, file.string() + ": error: cannot read the points of a potential; check 'file'");
    std::vector<double> r, v;
    for (const auto& row : rows_in(*text, file, 2, "not a point of a potential"))
      r.push_back(row[0]), v.push_back(row[1]);
    table.erase("file");
    table.set("r", std::move(r));
    table.set("value", std::move(v));
  }
  const auto* r = table.find<std::vector<double>>("r");
  if (r != nullptr && !r->empty() && !table.has("cutoff")) table.set("cutoff", r->back());
  return {};
}

std::size_t Deck::Source::particles() const {
  std::size_t n = 0;
  for (const SpeciesConfig& s : species) n += s.count;
  return n;
}

void interpret(DeckValues values, const TextReader& reader, Deck& deck, Problems& problems) {
  deck.source = std::make_shared<Deck::Source>();
  deck.source->values = std::move(values);
  Interpreter(deck, reader, problems).all();
}

}  // namespace carom
