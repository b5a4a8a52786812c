// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A deck, read, checked and resolved: everything a run needs, with defaults filled in.
//
//   Deck deck = read_deck("inputs/five-springs.toml", {"integrator.step=0.02"});   // Error(Failure::deck)
//   auto system = build_system<2>(deck);                                           // Error(Failure::initial_state)

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/integrators/integrator.h"
#include "engine/ranks/system.h"
#include "engine/run/observable.h"
#include "engine/run/simulation.h"
#include "engine/run/state.h"
#include "engine/setup/placement.h"

namespace carom {

struct ObservableConfig {
  const ObservableInfo* info;
  Parameters parameters;  ///< complete after build_system()
};

/// The units that a trajectory declares; no number depends on them.
struct Units {
  std::string length, time;
};

struct OutputConfig {
  std::filesystem::path directory;
  std::optional<double> checkpoint_wall;      ///< wall time between checkpoints [s]; nullopt: only at the end
  bool overwrite = false;                     ///< removes the files of an earlier run; false: keeps them
  double sample_start = 0;                    ///< simulated time of the first sample of the observables
  std::vector<ObservableConfig> observables;  ///< the observables with an interval
  std::optional<Units> units;                 ///< nullopt: reduced units
};

/// The deck as a value; `toml_text` is the resolved deck, which reproduces the run.
struct Deck {
  std::filesystem::path file;
  std::string title, description;
  int dimension = 2;
  std::string integrator;
  Parameters integrator_parameters;
  Plan plan;  ///< plan.step: the slab length (free flight: the epoch)
  OutputConfig output;
  std::vector<std::string> warnings;  ///< printed before the run
  std::string toml_text;

  struct Source;  ///< the parsed tables, deck_source.h
  std::shared_ptr<Source> source;
};

/// Reads the input texts of a run: the deck, and the positions it may name. Returns nullopt if the file cannot be read.
using TextReader = std::function<std::optional<std::string>(const std::filesystem::path&)>;

/// Reads a whole file.
std::optional<std::string> read_text(const std::filesystem::path& file);
/// Reads a file on rank 0 for all ranks, which may have no access to it. Collective.
TextReader reader_for(Communicator& ranks);

/// Reads, applies `table.key=value` overrides, validates against the schema, resolves defaults. The reader is called
/// for the deck, then for the positions. `replace`: if an override changes the type of a table, keys that the new type
/// does not know are dropped instead of being errors.
Deck read_deck(const std::filesystem::path& file, std::span<const std::string> overrides,
               const TextReader& reader = read_text, bool replace = false);

/// The resolved deck of a run, with overrides, for a branch that starts from its particles. `same_motion`: whether
/// forces and integrator stay as they were. Throws Error(Failure::deck), also if an override would change particles or
/// box. The reader is called for the file of positions again.
Deck read_branch(const Deck& of, std::span<const std::string> overrides, const TextReader& reader, bool& same_motion);

/// Sets the output directory, in the resolved deck too.
void set_output_directory(Deck& deck, const std::filesystem::path& directory);

/// The number of particles of a deck.
std::size_t particle_count(const Deck& deck);

/// A state to start from, instead of the initial state that the deck describes.
struct GivenState {
  StateReader read;  ///< called on rank 0
  std::vector<PairList>
      bonds;               ///< for each interaction that finds its bonds in the initial state, in the order of the deck
  double time = 0;         ///< time of the state
  std::int64_t steps = 0;  ///< and its number of steps
  bool branch =
      false;  ///< the state belongs to another deck: this deck's defaults are completed, and the state is checked
};

/// The bonds of each interaction that finds them in the initial state, in the order of the deck.
template <int D>
std::vector<PairList> found_bonds(const Deck& deck, const System<D>& system);

/// Builds the initial state and the interactions. May complete defaults that depend on it (deck.plan.step for free
/// flight, the box from the packing fraction) and appends warnings; deck.toml_text is final afterwards. A given state
/// replaces the initial one; for a continued run nothing is checked and no warning repeated. `pause` is called while
/// particles are placed, and may throw.
template <int D>
std::unique_ptr<System<D>> build_system(Deck& deck, Communicator* ranks = nullptr, const GivenState* given = nullptr,
                                        const Pause& pause = {});

}  // namespace carom
