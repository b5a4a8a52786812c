// SPDX-License-Identifier: BSD-3-Clause
#include "io/deck/deck_species.h"

#include <algorithm>

namespace carom {
namespace {

constexpr std::int64_t most = 1'000'000'000;  // ids have 32 bits, with room for several species

class SpeciesReader {
 public:
  SpeciesReader(const DeckValues& values, std::size_t dimension, std::vector<SpeciesConfig>& all, Problems& problems)
      : values_(values), dimension_(dimension), all_(all), problems_(problems) {}

  void all() {
    std::vector<std::string> names;
    for (const ValueTable& table : values_.list("particles")) {
      SpeciesConfig species;
      species.at = table.at;
      if (const auto* name = table.find<std::string>("name")) {
        if (std::find(names.begin(), names.end(), *name) != names.end())
          problems_.error(table.place("name"), "two species are called '" + *name + "'", "give each its own name");
        species.name = *name;
        names.push_back(*name);
      }
      positions(table, species);
      velocities(table, species);
      if (species.count > 0) {
        species.radius = numbers(table, "radius", species.count);
        species.mass = numbers(table, "mass", species.count);
        species.charge = numbers(table, "charge", species.count);
      }
      all_.push_back(std::move(species));
    }
  }

 private:
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
    } else if (count != nullptr && *count > most) {
      problems_.error(table.place("count"), "'count' is too large", "give at most " + std::to_string(most));
    } else if (count != nullptr) {
      species.count = static_cast<std::size_t>(*count);
      species.placed = true;
    }
  }

  void velocities(const ValueTable& table, SpeciesConfig& species) {
    if (const auto* temperature = table.find<double>("temperature")) species.temperature = *temperature;
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
    else if (table.given("count") && !table.given("temperature"))
      problems_.error(table.at, "missing key 'temperature' in [[particles]]",
                      "a species given by count needs it; 0 leaves the particles at rest");
  }

  void vectors(const ValueTable& table, const std::string& key, const std::vector<std::vector<double>>& list) {
    for (std::size_t n = 0; n < list.size() && dimension_ != 0; ++n)
      if (list[n].size() != dimension_)
        problems_.error(
            table.place(key),
            "vector " + std::to_string(n) + " (from 0) of '" + key + "' has " + count_of(list[n].size(), "number"),
            "system.dimension asks for " + std::to_string(dimension_));
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

  const DeckValues& values_;
  std::size_t dimension_;
  std::vector<SpeciesConfig>& all_;
  Problems& problems_;
};

}  // namespace

std::string count_of(std::size_t n, const std::string& what) {
  return std::to_string(n) + " " + what + (n == 1 ? "" : "s");
}

void read_species(const DeckValues& values, std::size_t dimension, std::vector<SpeciesConfig>& species,
                  Problems& problems) {
  SpeciesReader(values, dimension, species, problems).all();
}

std::size_t Deck::Source::particles() const {
  std::size_t n = 0;
  for (const SpeciesConfig& s : species) n += s.count;
  return n;
}

}  // namespace carom
