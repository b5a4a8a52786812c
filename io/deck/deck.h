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

namespace carom {

struct ObservableConfig {
  const ObservableInfo* info;
  Parameters parameters;  ///< complete after build_system()
};

/// What the numbers of a trajectory are said to be in; no number depends on it.
struct Units {
  std::string length, time;
};

struct OutputConfig {
  std::filesystem::path directory;
  std::optional<double> checkpoint_wall;      ///< wall time between checkpoints [s]; else none but at the end
  double sample_start = 0;                    ///< simulated time of the first sample of the observables
  std::vector<ObservableConfig> observables;  ///< those with an interval
  std::optional<Units> units;                 ///< else none: reduced
};

/// The deck as a value; `toml_text` is the resolved deck, which gives the same run when it is run again.
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

/// How the texts are read of which a run is made: the deck, and the positions it may name. Nothing: it cannot be read.
using TextReader = std::function<std::optional<std::string>(const std::filesystem::path&)>;

/// Reads a whole file.
std::optional<std::string> read_text(const std::filesystem::path& file);
/// Reads a file on rank 0, for all: the others may not see it. Collective.
TextReader reader_for(Communicator& ranks);

/// Reads, applies `table.key=value` overrides, validates against the schema, resolves defaults. The reader is called
/// for the deck, then for the positions. `replace`: where an override gives a table another type, the keys that this
/// does not know go, instead of being errors.
Deck read_deck(const std::filesystem::path& file, std::span<const std::string> overrides,
               const TextReader& reader = read_text, bool replace = false);

/// The resolved deck of a run, with overrides, for another one that starts from its particles. `same_motion`: they go
/// on moving as they did, under the same forces and by the same integrator. Throws Error(Failure::deck), also where an
/// override would change particles or box. The reader is called for the same file again.
Deck read_branch(const Deck& of, std::span<const std::string> overrides, const TextReader& reader, bool& same_motion);

/// Puts the results elsewhere than the deck says; the resolved deck says so too.
void set_output_directory(Deck& deck, const std::filesystem::path& directory);

/// How many particles it has.
std::size_t particle_count(const Deck& deck);

/// A state to go on from, instead of the initial one that the deck describes.
struct GivenState {
  StateReader read;             ///< called on rank 0
  std::vector<PairList> bonds;  ///< of each interaction that finds them in the initial state, in their order
  bool branch = false;          ///< of another deck: what it leaves open is completed, and the state is checked
};

/// Of each interaction of the deck that finds its bonds in the initial state, in their order.
template <int D>
std::vector<PairList> found_bonds(const Deck& deck, const System<D>& system);

/// Builds the initial state and the interactions. May complete defaults that depend on it (deck.plan.step for free
/// flight, the box from the packing fraction) and appends warnings; deck.toml_text is final afterwards. With a given
/// state it is that instead of the initial one, and of a run that is continued nothing is checked or warned of anew.
template <int D>
std::unique_ptr<System<D>> build_system(Deck& deck, Communicator* ranks = nullptr, const GivenState* given = nullptr);

}  // namespace carom
