// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The choice of the event core's search: neighbour lists or cells, the skin of the lists, the size of the cells.
//
// The choice depends on the density when the core is first loaded, later on counts of the core's work, never on a
// clock. Costs are instructions as callgrind counts them (tests/benchmarks): a dilute sphere crosses many cells or
// regions between two contacts, and cells are cheaper there because a crossing searches few new cells; in a dense fluid
// lists are cheaper, because a sphere has many contacts before it leaves its region.

#include <limits>
#include <span>
#include <vector>

#include "engine/base/event_counts.h"
#include "engine/search/cell_grid.h"

namespace carom {

/// How the core searches. No option changes a result; 0 and `automatic` leave the choice to the core.
struct SearchOptions {
  enum class Method : std::uint8_t { automatic, lists, cells, small_cells };
  Method method = Method::automatic;
  double skin = 0;             ///< how far a sphere may move before its list is renewed [length]
  double cell = 0;             ///< smallest edge of a cell [length]
  double small = 0;            ///< of small_cells: the largest reach of small spheres [length]
  double entries_per_bin = 0;  ///< entries per bin of the calendar
  double sort_interval = 20;   ///< contacts per particle between two sorts of the particles in space
  double in_cache = 16384;     ///< spheres that fit in a cache, an eighth in a fast one; more are prefetched (0: all)
};

/// The properties of a system on which the choice depends.
struct SearchSituation {
  int dimension = 3;
  double density = 0;            ///< particles per volume
  double filled = 0;             ///< packing fraction
  double mean = 0, largest = 0;  ///< diameters
  /// The spheres in octaves of sizes, the largest ones first; empty if all must be searched in one way.
  struct SizeClass {
    double number = 0, mean = 0, largest = 0;  ///< of spheres; diameters
    double speed_squared = 0;                  ///< mean
  };
  std::vector<SizeClass> classes{};
};

/// For `extent.particles` particles; `numbers` holds the number of particles of each radius, equal numbers if it is
/// empty.
template <int D>
SearchSituation situation_of(const Box<D>& box, std::span<const double> radii, const Extent<D>& extent,
                             std::span<const double> numbers = {});

/// The approximate number of collisions of a sphere while a thermal sphere flies the length 1: Enskog's theory for
/// spheres of diameter `largest`.
double contacts_a_length(const SearchSituation& situation);

class SearchTuning {
 public:
  explicit SearchTuning(const SearchOptions& options) : options_(options) {}

  /// Makes the choice; `counts` are the core's counts since its construction.
  void choose(const SearchSituation& situation, const EventCounts& counts);

  bool lists() const { return lists_; }
  double skin() const { return skin_; }  ///< skin of the lists
  double cell() const { return cell_; }  ///< smallest edge of the cells
  /// The largest reach of spheres that are in cells, if larger ones are beside them (LargeSpheres); else infinite.
  double small() const { return small_; }

 private:
  void choose_first(const SearchSituation& situation);
  void split(const SearchSituation& situation, double cost_now);
  void adapt_skin(const SearchSituation& situation, double candidates, double rebuilds);

  SearchOptions options_;
  bool chosen_ = false, lists_ = true;
  static constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  double skin_ = 0, cell_ = 0, small_ = kNoLimit;
  // The candidates grow as this power of the reach, and renewals as this power of the skin. These are rough values for
  // a dense fluid, until a change of the skin has shown better ones. Measured were 1.9 and −2.0 at a packing fraction
  // of 0.49, 3 and −1.5 at 0.33.
  double candidates_exponent_ = 2, rebuilds_exponent_ = -2.2;
  // The skin at the last call, and the candidates and renewals per prediction with it.
  struct {
    double skin = 0, candidates = 0, rebuilds = 0;
  } seen_;
  EventCounts before_;
};

}  // namespace carom
