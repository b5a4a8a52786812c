// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What a checked deck says, in the words of a simulation: known to io/deck, and to io/python, which takes the
// interactions.

#include <optional>

#include "io/deck/deck.h"
#include "io/deck/deck_values.h"

namespace carom {

struct SpeciesConfig {
  std::string name;
  Place at;
  std::size_t count = 0;
  bool placed = false;  ///< given by count: [placement] finds the positions
  std::vector<std::vector<double>> position, velocity;
  std::optional<double> temperature;
  std::vector<double> radius, mass, charge;  ///< one for each particle, or one for all

  static double of(const std::vector<double>& values, std::size_t n) { return values[values.size() == 1 ? 0 : n]; }
};

struct PlacementConfig {
  Place at;
  std::string type;  ///< empty: there is no [placement]
  std::optional<double> packing_fraction;
  std::uint64_t seed = 1;
  std::filesystem::path file;
  std::vector<std::vector<double>> positions;  ///< those of the file
  double growth_rate = 0, max_collisions = 0;  ///< compressed: engine/setup/compression.h
};

struct InteractionConfig {
  const InteractionInfo* info = nullptr;
  Parameters parameters;
  Place at;
};

struct Deck::Source {
  DeckValues values;
  Place system, box, step;
  std::vector<double> edges;  ///< empty: the packing fraction sets them
  std::vector<Boundary> boundary;
  std::vector<SpeciesConfig> species;
  PlacementConfig placement;
  std::vector<InteractionConfig> interactions;
  const IntegratorInfo* integrator = nullptr;

  std::size_t particles() const;
};

}  // namespace carom
