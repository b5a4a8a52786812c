// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The contents of a checked deck as a simulation needs them. Used by io/deck, and by io/python for the interactions. A
// deck is read in three steps: read_values() (deck_values.h), interpret(), build_system() (deck.h).

#include <optional>

#include "engine/setup/placement.h"
#include "io/deck/deck.h"
#include "io/deck/deck_values.h"

namespace carom {

struct SpeciesConfig {
  std::string name;
  Place at;
  std::size_t count = 0;
  bool placed = false;  ///< given by count: [placement] finds the positions
  std::vector<std::vector<double>> position, velocity, spin;
  std::optional<double> temperature, rotational_temperature;
  std::vector<double> radius, mass, charge;  ///< one for each particle, or one for all
  double inertia = 0;                        ///< reduced; 0: homogeneous
  bool fixed = false;                        ///< then the mass is infinite

  static double of(const std::vector<double>& values, std::size_t n) { return values[values.size() == 1 ? 0 : n]; }
};

struct PlacementConfig {
  Place at;
  std::string type;  ///< empty: there is no [placement]
  std::optional<double> packing_fraction;
  std::uint64_t seed = 1;
  std::filesystem::path file;
  std::vector<std::vector<double>> positions;  ///< from the file
  double growth_rate = 0, max_collisions = 0;  ///< compressed: engine/setup/compression.h
  std::optional<double> distance;              ///< random: between two particles without cores

  bool lattice() const { return !type.empty() && type != "random" && type != "compressed" && type != "file"; }
};

struct InteractionConfig {
  const InteractionInfo* info = nullptr;
  Parameters parameters;
  Place at;
  bool wrong = false;  ///< a problem with it has been reported
};

struct Deck::Source {
  DeckValues values;
  Place system, box, step, shear;
  std::vector<double> edges;  ///< empty: the packing fraction sets them
  std::vector<Boundary> boundary;
  double shear_rate = 0, tilt = 0;
  std::vector<std::array<double, 2>> shear_rates;
  std::vector<SpeciesConfig> species;
  PlacementConfig placement;
  std::vector<InteractionConfig> interactions;
  const IntegratorInfo* integrator = nullptr;

  std::size_t particles() const;
};

/// Checks the values of a deck against each other: lengths of lists, ids that exist, tables that need each other; the
/// checks of an interaction itself run by making it. Fills all of `deck` but toml_text and the positions in a file.
/// Errors go to `problems`; the deck must not be used then. The reader is called for files with points of potentials,
/// and the points are stored in the values. Throws Error(Failure::file), and Failure::deck for errors in a file of
/// points.
void interpret(DeckValues values, const TextReader& reader, Deck& deck, Problems& problems);

/// Boundaries, edges (1 if they follow from the packing fraction), walls, contacts, the bath and the names of species.
template <int D>
void fill_box(const Deck::Source& source, System<D>& system);

/// Makes every interaction that has no error yet, and checks that the integrator supports it; `placed`: whether the
/// positions are known. Errors of an interaction go to `problems` with its place.
template <int D>
void make_interactions(const Deck::Source& source, System<D>& system, bool placed, Problems& problems);

/// Whether each rank can build its own block of the initial state: lattices of species with identical particles.
bool built_in_blocks(const Deck::Source& source);

/// Positions as [placement] says, for species given by count. Sets the box if it follows from the packing fraction.
template <int D>
void place_particles(const Deck::Source& source, System<D>& system, const Pause& pause);

/// The smallest distance between two particles without cores in a random placement, if the deck gives none: that at
/// which spheres of this diameter fill half as much of the box as random insertion can.
template <int D>
double default_distance(std::size_t particles, double volume);

/// Replaces the `file` of a table potential, relative to `folder`, by its points, and sets a missing cutoff to the last
/// point. Returns what is wrong, in the form "what; remedy", or nothing. Throws Error(Failure::file), and Failure::deck
/// for errors in the file.
std::string read_points(Parameters& table, const std::filesystem::path& folder, const TextReader& reader);

/// The rows of a table of numbers: `columns` a line, separated by commas or blanks; # begins a comment, and the first
/// line may be a heading. Throws Error(Failure::deck), which says that a line is `not_what` it should be.
std::vector<std::vector<double>> rows_in(const std::string& text, const std::filesystem::path& file,
                                         std::size_t columns, const std::string& not_what);

}  // namespace carom
