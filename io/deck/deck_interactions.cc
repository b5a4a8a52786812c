// SPDX-License-Identifier: BSD-3-Clause
#include "io/deck/deck_interactions.h"

#include <algorithm>
#include <array>

#include "engine/forces/pair_filter.h"
#include "engine/ranks/id_blocks.h"
#include "io/deck/deck_build.h"
#include "io/deck/deck_interpret.h"
#include "io/deck/deck_species.h"

namespace carom {
namespace {

void ids_exist(const Deck::Source& source, const ValueTable& table, Problems& problems) {
  const std::size_t n = source.particles();
  table.each_key([&](const Key& key) {
    const auto* pairs = table.find<PairList>(key.name);
    if (pairs == nullptr) return;
    for (const auto& pair : *pairs) {
      const std::string text = "[" + std::to_string(pair[0]) + ", " + std::to_string(pair[1]) + "]";
      for (const std::uint32_t id : pair)
        if (id >= n)
          problems.error(table.place(key.name),
                         "pair " + text + " names particle " + std::to_string(id) + ", which is not there",
                         "there are " + count_of(n, "particle") + ", with ids from 0");
      if (pair[0] == pair[1])
        problems.error(table.place(key.name), "pair " + text + " joins a particle to itself", "name two particles");
    }
  });
}

void species_exist(const Deck::Source& source, const ValueTable& table, Problems& problems) {
  const auto* named = table.find<std::vector<std::string>>("species");
  if (named == nullptr) return;
  std::vector<std::string> known;
  for (const SpeciesConfig& species : source.species) known.push_back(species.name);
  for (const std::string& name : *named)
    if (std::find(known.begin(), known.end(), name) == known.end())
      problems.error(table.place("species"), "unknown species '" + name + "'", suggestion(name, known));
}

/// Whether enough is known of the particles and the box to make interactions for them.
bool ready(const Deck::Source& source, std::size_t dimension) {
  const bool box = dimension != 0 && source.boundary.size() == dimension &&
                   (source.edges.empty() || source.edges.size() == dimension);
  return box && std::all_of(source.species.begin(), source.species.end(), [](const SpeciesConfig& s) {
           return s.count > 0 && std::ranges::all_of(std::array{s.mass.size(), s.radius.size(), s.charge.size()},
                                                     [&](std::size_t n) { return n == 1 || n == s.count; });
         });
}

template <int D>
void try_interactions(const Deck::Source& source, const std::vector<bool>& skip, Problems& problems) {
  System<D> system;
  fill_box(source, system);
  make_interactions(source, skip, system, false, problems);
}

}  // namespace

void read_potentials(DeckValues& values, const std::filesystem::path& folder, const TextReader& reader,
                     Problems& problems) {
  for (ValueTable& table : values.list("interaction")) {
    if (table.variant == nullptr || table.variant->name != "table") continue;
    if (const auto* name = table.find<std::string>("file")) {
      if (table.given("r") || table.given("value")) {
        problems.error(table.place("file"), "'file' and the points themselves exclude each other",
                       "leave one of them out");
        continue;
      }
      const std::filesystem::path file = folder / *name;
      const auto text = reader(file);
      if (!text)
        throw Error(Failure::file, file.string() + ": error: cannot read the points of a potential; check 'file'");
      std::vector<double> r, v;
      for (const auto& row : rows_in(*text, file, 2, "not a point of a potential"))
        r.push_back(row[0]), v.push_back(row[1]);
      table.values.erase("file");
      table.values.insert_or_assign("r", std::move(r));
      table.values.insert_or_assign("value", std::move(v));
    }
    const auto* r = table.find<std::vector<double>>("r");
    if (r != nullptr && !r->empty() && !table.given("cutoff")) table.values.insert_or_assign("cutoff", r->back());
  }
}

void read_interactions(Deck::Source& source, std::size_t dimension, Problems& problems) {
  std::vector<bool> wrong;
  for (const ValueTable& table : source.values.list("interaction")) {
    if (table.variant == nullptr) continue;
    const std::size_t before = problems.errors();
    InteractionConfig config;
    config.at = table.at;
    config.parameters = parameters_of(table);
    config.info = &find_interaction(table.variant->name);
    bool complete = true;
    table.each_key([&](const Key& key) {
      if ((key.required() || table.given(key.name)) && table.values.find(key.name) == table.values.end())
        complete = false;
    });
    ids_exist(source, table, problems);
    species_exist(source, table, problems);
    wrong.push_back(!complete || problems.errors() > before);
    source.interactions.push_back(std::move(config));
  }
  if (!ready(source, dimension) || source.interactions.empty()) return;
  if (dimension == 2)
    try_interactions<2>(source, wrong, problems);
  else
    try_interactions<3>(source, wrong, problems);
}

template <int D>
void make_interactions(const Deck::Source& source, const std::vector<bool>& skip, System<D>& system, bool placed,
                       Problems& problems) {
  InteractionContext<D> context{.box = system.box,
                                .particles = system.particles,
                                .species = system.species,
                                .placed = placed,
                                .total = source.particles(),
                                .ranks = system.decomposition.others()};
  const auto bonded = [](const InteractionConfig& config) {
    return config.info->kind == InteractionInfo::Kind::bonded;
  };
  std::vector<std::unique_ptr<Interaction<D>>> terms(source.interactions.size());
  const auto make = [&](std::size_t n) {
    const InteractionConfig& config = source.interactions[n];
    if (n < skip.size() && skip[n]) return;
    try {
      auto term = config.info->make<D>(config.parameters, context);
      if (source.integrator != nullptr && !source.integrator->smooth_forces && term->common_acceleration() == nullptr)
        problems.error(config.at,
                       std::string(source.integrator->name) + " cannot carry the interaction '" +
                           std::string(config.info->name) + "'",
                       "it knows no forces but a uniform-field; leave the interaction out, or take psa, edda or "
                       "their relatives");
      terms[n] = std::move(term);
    } catch (const Error& e) {  // its message has the form "what; what to do"
      const std::string message = e.what();
      const std::size_t cut = std::min(message.find("; "), message.size());
      problems.error(config.at, message.substr(0, cut),
                     cut < message.size() ? message.substr(cut + 2) : "see `carom schema`");
    }
  };
  const auto& all = source.interactions;  // bonds before the terms that leave out bonded pairs
  for (std::size_t n = 0; n < all.size(); ++n)
    if (bonded(all[n])) make(n);
  context.bonds = bonds_of(terms);
  if (!context.bonds && std::ranges::any_of(all, bonded)) context.bonds = std::make_shared<BondTable>(PairList());
  for (std::size_t n = 0; n < all.size(); ++n)
    if (!bonded(all[n])) make(n);
  for (auto& term : terms)
    if (term) system.interactions.push_back(std::move(term));
}

template void make_interactions(const Deck::Source&, const std::vector<bool>&, System<2>&, bool, Problems&);
template void make_interactions(const Deck::Source&, const std::vector<bool>&, System<3>&, bool, Problems&);

}  // namespace carom
