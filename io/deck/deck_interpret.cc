// SPDX-License-Identifier: BSD-3-Clause
#include "io/deck/deck_interpret.h"

#include <algorithm>

#include "io/deck/deck_interactions.h"
#include "io/deck/deck_species.h"
#include "io/deck/options.h"

namespace carom {
namespace {

/// Sets a parameter to the value of a key, if it has one.
void copy_value(const ValueTable& table, std::string_view key, Parameters& parameters, std::string_view name) {
  const auto at = table.values.find(key);
  if (at == table.values.end()) return;
  std::visit(
      [&](const auto& value) {
        if constexpr (std::is_constructible_v<ParameterValue, decltype(value)>)
          parameters.set(std::string(name), value);
      },
      at->second);
}

/// The parts of a deck in the order in which they build on each other.
class Interpreter {
 public:
  Interpreter(Deck& deck, Problems& problems)
      : deck_(deck), source_(*deck.source), values_(source_.values), problems_(problems) {}

  void all() {
    top();
    system();
    read_species(values_, dimension_, source_.species, problems_);
    placement();
    integrator();
    read_interactions(source_, dimension_, problems_);
    run();
    output();
  }

 private:
  void top() {
    const ValueTable& table = *values_.find("");
    if (const auto* format = table.find<std::int64_t>("format"); format != nullptr && *format != 1)
      problems_.error(table.place("format"), "unknown deck format " + std::to_string(*format),
                      "this version reads format 1");
    if (const auto* title = table.find<std::string>("title")) deck_.title = *title;
    if (const auto* description = table.find<std::string>("description")) deck_.description = *description;
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
  }

  void one_an_axis(const ValueTable& table, const std::string& key, std::size_t size) {
    if (dimension_ != 0 && size != dimension_)
      problems_.error(table.place(key), "'" + key + "' has the wrong length (" + std::to_string(size) + ")",
                      "give " + std::to_string(dimension_) + ", one for each axis");
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
      if (const auto* seed = table->find<std::int64_t>("seed")) placement.seed = static_cast<std::uint64_t>(*seed);
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
      if (const auto* file = table->find<std::string>("file"))
        placement.file = std::filesystem::absolute(deck_.file.parent_path() / *file).lexically_normal();
    }
    if (system != nullptr && !system->given("box") && (table == nullptr || !table->given("packing_fraction")))
      problems_.error(system->at, "missing key 'box' in [system]",
                      "give the edges, or placement.packing_fraction to set them");
  }

  void compressed(const ValueTable& table, bool mixed) {
    PlacementConfig& placement = source_.placement;
    if (const auto* rate = table.find<double>("growth_rate")) placement.growth_rate = *rate;
    if (const auto* most = table.find<double>("max_collisions")) placement.max_collisions = *most;
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
    deck_.integrator_parameters = parameters_of(*table);
    source_.step = table->place("step");
    source_.integrator = &find_integrator(deck_.integrator);
    if (const auto* step = table->find<double>("step")) deck_.plan.step = *step;
  }

  void run() {
    const ValueTable* table = values_.find("run");
    if (table == nullptr) return;
    const auto* steps = table->find<std::int64_t>("steps");
    const auto* collisions = table->find<std::int64_t>("collisions");
    const auto* end_time = table->find<double>("end_time");
    if (steps != nullptr) deck_.plan.steps = *steps;
    if (end_time != nullptr) deck_.plan.end_time = *end_time;
    if (collisions != nullptr) deck_.plan.collisions = static_cast<std::uint64_t>(*collisions);
    if (!table->given("steps") && !table->given("end_time") && !table->given("collisions"))
      problems_.error(table->at, "[run] has no end", "give steps, end_time or collisions");
    if (source_.integrator != nullptr && !source_.integrator->hard_cores && table->given("collisions") &&
        !table->given("steps") && !table->given("end_time"))
      problems_.error(table->place("collisions"),
                      "'" + deck_.integrator + "' has no collisions, the run would never end",
                      "give steps or end_time");
  }

  void output() {
    ValueTable* table = values_.find("output");
    if (table == nullptr) return;
    if (!table->given("directory"))
      table->values.insert_or_assign("directory", (std::filesystem::path("runs") / deck_.file.stem()).string());
    if (const auto* directory = table->find<std::string>("directory")) {
      deck_.output.directory = *directory;
      if (directory->empty()) problems_.error(table->place("directory"), "'directory' is empty", "name a folder");
    }
    if (const auto* interval = table->find<double>("frame_interval")) deck_.plan.frame_interval = *interval;
    if (const auto* interval = table->find<double>("thermo_interval")) deck_.plan.thermo_interval = *interval;
    if (const auto* start = table->find<double>("sample_start")) deck_.output.sample_start = *start;
    for (const ObservableInfo& info : observables()) {
      Parameters parameters;
      for (const Parameter& each : info.parameters)
        copy_value(*table, output_key(info, each.name), parameters, each.name);
      if (parameters.has("interval") && parameters.real("interval") > 0)
        deck_.output.observables.push_back({&info, std::move(parameters)});
    }
    if (const auto* units = table->find<std::map<std::string, std::string>>("units"))
      deck_.output.units = {units->at("length"), units->at("time")};
    if (const auto* events = table->find<bool>("events")) deck_.plan.events = *events;
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
  Problems& problems_;
  std::size_t dimension_ = 0;  // 0: unknown
};

}  // namespace

Parameters parameters_of(const ValueTable& table) {
  Parameters parameters;
  for (const Key& key : table.variant->keys) copy_value(table, key.name, parameters, key.name);
  return parameters;
}

void interpret(DeckValues values, Deck& deck, Problems& problems) {
  deck.source = std::make_shared<Deck::Source>();
  deck.source->values = std::move(values);
  Interpreter(deck, problems).all();
}

}  // namespace carom
