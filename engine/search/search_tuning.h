// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// How the event core searches: on neighbour lists or on cells, with which skin, with which cells.
//
// A choice is made from the density when the core is loaded first, and again from what has been counted since, never
// from a clock. Costs are instructions, as callgrind counts them (tests/benchmarks): a dilute sphere flies through many
// cells or regions between two contacts, so cells win there, which look at few new ones; in a dense fluid lists win,
// because a region is left once in many contacts.

#include <span>

#include "engine/base/event_counts.h"
#include "engine/search/cell_grid.h"

namespace carom {

/// How the core searches. Nothing of it changes a result; 0 and nothing mean: as the core thinks best.
struct SearchOptions {
  enum class Method : std::uint8_t { automatic, lists, cells };
  Method method = Method::automatic;
  double skin = 0;             ///< how far a sphere may move before its list is renewed [length]
  double cell = 0;             ///< least edge of a cell [length]
  double entries_per_bin = 0;  ///< of the calendar
  double sort_interval = 20;   ///< contacts a particle after which the particles are sorted in space again
  double in_cache = 16384;     ///< spheres that a cache holds, a fast one an eighth; more are fetched ahead (0: all)
};

/// What the choice depends on.
struct SearchSituation {
  int dimension = 3;
  double density = 0;            ///< particles a volume
  double filled = 0;             ///< packing fraction
  double mean = 0, largest = 0;  ///< diameters
};

/// For so many particles as `extent` has, with radii like these, of each of which there is the given number; empty: as
/// many of each.
template <int D>
SearchSituation situation_of(const Box<D>& box, std::span<const double> radii, const Extent<D>& extent,
                             std::span<const double> numbers = {});

/// Collisions of a sphere while a thermal sphere flies the length 1, about: Enskog's theory, for `largest` diameters.
double contacts_a_length(const SearchSituation& situation);

class SearchTuning {
 public:
  explicit SearchTuning(const SearchOptions& options) : options_(options) {}

  /// Chooses; `counts` are those of the core since it was made.
  void choose(const SearchSituation& situation, const EventCounts& counts);

  bool lists() const { return lists_; }
  double skin() const { return skin_; }  ///< of the lists
  double cell() const { return cell_; }  ///< least edge of the cells

 private:
  void choose_first(const SearchSituation& situation);
  void adapt_skin(const SearchSituation& situation, double predictions, double candidates, double rebuilds);

  SearchOptions options_;
  bool chosen_ = false, lists_ = true;
  double skin_ = 0, cell_ = 0;
  EventCounts before_;
};

}  // namespace carom
