// SPDX-License-Identifier: BSD-3-Clause
#include "engine/search/search_tuning.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/base/elementary.h"

namespace carom {
namespace {

// Instructions, as callgrind counts them.
constexpr double kPrediction = 400, kCandidate = 32;  // per prediction and per candidate on a list
constexpr double kRenewal = 4500;                     // per renewal of a list
constexpr double kCellHead = 9, kCellCandidate = 60;  // per prediction on cells: for each cell and each candidate
constexpr double kCrossing = 550;                     // per crossing, without new cells and candidates
constexpr double kStalePlans = 2;                     // predictions of a large sphere among small ones per contact
constexpr double kBlock = 400, kMember = 60;          // per renewal of a region: for each block and each small sphere
constexpr double kScan = 60;                          // per scan of the large spheres of a block
constexpr double kCompare = 8, kNew = 0.3;            // per crossing of blocks: for two lists; share of new spheres
constexpr double kFewestPredictions = 20000;          // before counts are used
constexpr double kCrowded = 40, kUneven = 2.5;        // candidates per scan of cells above which lists are cheaper
constexpr double kLargestSkin = 0.8, kSmallestSkin = 0.02, kCrowdedSkin = 0.4;  // in mean diameters
// Cells for all spheres are kept unless large ones beside them seem cheaper by this factor, which is as rough as the
// estimates: at 0.1, diameters 1:2 are faster in one grid, 1:2.5 with the large ones beside it, and both get that.
constexpr double kCheaper = 0.7;
// Large spheres are beside the cells up to this packing fraction if a cell for the largest sphere would hold so many,
// otherwise up to dense(). With diameters 1:10, lists take twice the instructions at 0.3, 1.3 times at 0.42 and as many
// at 0.5; at 0.4 lists are faster for 1:2 and 1:2.5 (3.4 and 6.3 in a cell), slower for 1:4 (25).
constexpr double kDenseMixture = 0.5, kManyInCell = 12;
// The candidates of a mean sphere up to which a larger skin is cheaper in dilute mixtures: with about so many,
// diameters 1:10 took the fewest instructions at packing fractions of 0.02, 0.05 and 0.1, and discs at 0.02 to 0.35.
constexpr double kShortList = 12;

/// The packing fraction above which lists are faster than cells, as measured for equal spheres and discs. In three
/// dimensions, lists and cells are equally fast at 0.345 with 10³ spheres and at 0.37 with 10⁴; in two dimensions, at
/// 0.58 with 10⁴ discs.
double dense(int dimension) { return dimension == 2 ? 0.58 : 0.355; }

/// The cells that a prediction searches; a crossing searches a third of them.
double cells_around(int dimension) { return dimension == 2 ? 9 : 27; }

/// The mean number of particles in a cell with this edge.
double in_cell(const SearchSituation& s, double edge) { return s.density * elementary::pow(edge, s.dimension); }

/// Whether lists are faster because a cell as large as the largest sphere holds many small ones. Lists cost a renewal
/// each time a sphere has moved by the skin, and the fewer contacts there are in between, the more of them. Counted for
/// spheres of diameters 1:10, 1:4 and 1:2.5, half of the volume each: both take equally many instructions with 12.5,
/// 4.4 and 2.5 particles in a cell, at packing fractions of 0.013, 0.07 and 0.16. So do discs of diameters 1:10 and 1:4
/// with 8 and 3.8, at 0.125 and 0.35.
bool mixed(const SearchSituation& s) {
  return elementary::pow(s.filled, 0.64) * in_cell(s, s.largest) > (s.dimension == 2 ? 2 : 0.78);
}

/// The skin with which the list of a sphere of the mean diameter has kShortList candidates.
double short_list_skin(const SearchSituation& s) {
  const double unit = s.dimension == 2 ? std::numbers::pi : 4 * std::numbers::pi / 3;
  return 0.5 * (elementary::pow(kShortList / (s.density * unit), 1.0 / s.dimension) - s.mean);
}

struct CellChoice {
  double edge, cost;  // cost in instructions, for a sphere that flies the length 1
};

/// The cheapest edge of cells: small cells are crossed often, large ones hold many candidates.
CellChoice best_cell(const SearchSituation& s) {
  const double around = cells_around(s.dimension), ahead = around / 3;
  CellChoice best{s.largest, std::numeric_limits<double>::infinity()};
  SearchSituation met = s;  // spheres of the mean diameter
  met.largest = s.mean;
  for (double edge = s.largest; in_cell(s, edge) < 3; edge *= 1.1) {
    const double inside = in_cell(s, edge);
    const double predictions = 1.1 * contacts_a_length(met),
                 crossings = s.dimension * std::sqrt(2 / std::numbers::pi) / edge;
    const double cost = predictions * (kPrediction + around * (kCellHead + kCellCandidate * inside)) +
                        crossings * (kCrossing + ahead * (kCellHead + kCellCandidate * inside));
    if (cost < best.cost) best = {edge, cost};
  }
  return best;
}

/// The volume or area of a ball.
double ball(int dimension, double radius) {
  return (dimension == 2 ? std::numbers::pi : 4 * std::numbers::pi / 3) * elementary::pow(radius, dimension);
}

/// Small spheres in cells of this edge, and large ones beside them, which may move by `skin`.
struct Beside {
  SearchSituation smalls;
  double edge, skin;

  double crossings() const { return smalls.dimension * std::sqrt(2 / std::numbers::pi) / edge; }
  /// The volume of the region of a large sphere, and the small spheres in it.
  double region(double radius) const { return ball(smalls.dimension, radius + 0.5 * smalls.largest + skin + edge); }
  double candidates(double radius) const { return smalls.density * (region(radius) - ball(smalls.dimension, radius)); }
  /// The work for a large sphere, in instructions, while a small one flies the length 1; `speed` is relative to that of
  /// small spheres.
  double cost_of_large(double radius, double speed) const {
    SearchSituation met = smalls;  // equal spheres that are met as often
    met.largest = radius + 0.5 * smalls.largest;
    const double predictions = kStalePlans * contacts_a_length(met) * std::sqrt(0.5 * (1 + speed * speed));
    return predictions * (kPrediction + candidates(radius) * kCandidate) +
           speed / skin *
               (kRenewal + region(radius) / elementary::pow(2 * edge, smalls.dimension) * kBlock +
                candidates(radius) * kMember);
  }
  /// The work for a small sphere because so many large ones are listed in its block, which have so many candidates.
  double cost_of_small(double listed, double candidates) const {
    return 1.1 * contacts_a_length(smalls) * (kScan + listed * kCandidate) +
           0.5 * crossings() * (kScan + kCompare * listed * listed + kNew * listed * (kScan + candidates));
  }
};

}  // namespace

// Uses the contact values of Henderson and of Carnahan and Starling.
double contacts_a_length(const SearchSituation& s) {
  const double filled = std::min(s.filled, 0.8), empty = 1 - filled;
  const double contact_value =
      s.dimension == 2 ? (1 - 7 * filled / 16) / (empty * empty) : (1 - filled / 2) / (empty * empty * empty);
  const double cross_section = s.dimension == 2 ? 2 * s.largest : 4 * s.largest * s.largest;
  return std::sqrt(std::numbers::pi) * s.density * cross_section * contact_value;
}

template <int D>
SearchSituation situation_of(const Box<D>& box, std::span<const double> radii, const Extent<D>& extent,
                             std::span<const double> numbers) {
  const auto n = static_cast<double>(extent.particles), each = n / static_cast<double>(radii.size());
  double largest = 0, sum = 0, sum_of_powers = 0;
  for (std::size_t k = 0; k < radii.size(); ++k) {
    const double r = radii[k], number = numbers.empty() ? each : numbers[k];
    largest = std::max(largest, r);
    sum += number * r;
    sum_of_powers += number * elementary::pow(r, D);
  }
  double volume = 1;
  for (int k = 0; k < D; ++k) {
    const double occupied = extent.high[k] - extent.low[k] + 2 * largest;
    volume *= box.bounded(k) ? box.edges[k] : occupied;
  }
  const double filled = (D == 2 ? std::numbers::pi : 4 * std::numbers::pi / 3) * sum_of_powers / volume;
  return {D, n / volume, filled, 2 * sum / n, 2 * largest};
}
template SearchSituation situation_of<2>(const Box<2>&, std::span<const double>, const Extent<2>&,
                                         std::span<const double>);
template SearchSituation situation_of<3>(const Box<3>&, std::span<const double>, const Extent<3>&,
                                         std::span<const double>);

void SearchTuning::choose(const SearchSituation& situation, const EventCounts& counts) {
  if (!chosen_) {
    choose_first(situation);
    before_ = counts;
  } else if (small_ < kNoLimit && options_.method == SearchOptions::Method::automatic) {
    split(situation, kNoLimit);  // spheres may have grown
  }
  const auto predictions = static_cast<double>(counts.predictions - before_.predictions);
  if (predictions > kFewestPredictions) {
    const auto candidates = static_cast<double>(counts.candidates - before_.candidates);
    const auto rebuilds = static_cast<double>(counts.rebuilds - before_.rebuilds);
    if (lists_ && options_.skin == 0) adapt_skin(situation, candidates / predictions, rebuilds / predictions);
    // A crossing searches a third of the cells around. If they hold far more spheres than at an even density, a region
    // is crowded.
    const double scans = predictions + static_cast<double>(counts.crossings - before_.crossings) / 3;
    const double even = cells_around(situation.dimension) * in_cell(situation, cell_);
    if (!lists_ && small_ == kNoLimit && options_.method == SearchOptions::Method::automatic &&
        candidates > std::max(kCrowded, kUneven * even) * scans) {
      lists_ = true;
      if (options_.skin == 0) skin_ = std::min(skin_, kCrowdedSkin * situation.mean);  // the mean density says little
    }
    before_ = counts;
  }
  // The smallest cell that cells and regions allow in any case.
  cell_ = std::max(cell_, std::min(situation.largest, 2 * small_));
}

void SearchTuning::choose_first(const SearchSituation& s) {
  chosen_ = true;
  if (options_.method == SearchOptions::Method::small_cells) {
    lists_ = false;
    small_ = options_.small;
    cell_ = options_.cell;
    skin_ = options_.skin;
    return;
  }
  lists_ = options_.method == SearchOptions::Method::automatic ? s.filled > dense(s.dimension) || mixed(s)
                                                               : options_.method == SearchOptions::Method::lists;
  // The approximate space that each sphere has beyond close packing.
  const double close = s.dimension == 2 ? 0.9069 : 0.7405, filled = std::clamp(s.filled, 0.01, 0.99 * close);
  const double room = s.mean * (elementary::pow(close / filled, 1.0 / s.dimension) - 1);
  skin_ = options_.skin > 0 ? options_.skin
                            : std::clamp(2 * room, 0.1 * s.mean, std::max(kCrowdedSkin * s.mean, short_list_skin(s)));
  cell_ = options_.cell > 0 ? options_.cell : best_cell(s).edge;
  if (options_.method == SearchOptions::Method::automatic &&
      s.filled < (in_cell(s, s.largest) > kManyInCell ? kDenseMixture : dense(s.dimension)))
    split(s, lists_ ? kNoLimit : best_cell(s).cost);
}

/// Puts only spheres up to some octave of sizes into cells, if that is possible and cheaper than this for a sphere.
void SearchTuning::split(const SearchSituation& s, double cost_now) {
  double all = 0, sum = 0, squares = 0, smalls = 0;
  for (const SearchSituation::SizeClass& each : s.classes) all += each.number;
  double least = kCheaper * all * cost_now;
  for (std::size_t k = s.classes.size(); k-- > 1;) {  // from the smallest spheres up; some are always beside the cells
    const SearchSituation::SizeClass& added = s.classes[k];
    if (added.number == 0) continue;
    smalls += added.number;
    sum += added.number * added.mean;
    squares += added.number * added.speed_squared;
    if (added.largest == 0) continue;  // points do not meet each other
    const SearchSituation small{s.dimension, s.density * smalls / all, s.filled, sum / smalls, added.largest, {}};
    const CellChoice cells = best_cell(small);
    for (const double skin : {0.25 * small.mean, 0.5 * small.mean, small.mean, 2 * small.mean}) {
      const Beside beside{small, cells.edge, skin};
      double cost = smalls * cells.cost, listed = 0, candidates = 0;
      for (std::size_t q = 0; q < k; ++q) {
        const SearchSituation::SizeClass& large = s.classes[q];
        if (large.number == 0) continue;
        const double speed = squares > 0 ? std::sqrt(large.speed_squared * smalls / squares) : 1;
        const double radius = 0.5 * large.largest, share = large.number / all * s.density * beside.region(radius);
        cost += large.number * beside.cost_of_large(radius, speed);
        listed += share;
        candidates += share * beside.candidates(radius);
      }
      if (listed > 0) cost += smalls * beside.cost_of_small(listed, candidates / listed);
      if (cost < least) {
        least = cost;
        lists_ = false;
        small_ = 0.5 * small.largest * (1 + 1e-9);
        cell_ = cells.edge;
        skin_ = skin;
      }
    }
  }
}

/// Scales the skin to the lowest sum of the costs of predictions, which increase with the candidates, and of renewals.
/// Near the present skin, candidates are a power of the reach and renewals a power of the skin. The exponents follow
/// from the last two skins, because they depend on the structure of the fluid: in a crystal, renewals become rare once
/// the skin is larger than the vibrations.
void SearchTuning::adapt_skin(const SearchSituation& s, double candidates, double rebuilds) {
  const double reach = s.largest + 2 * skin_, reach_before = s.largest + 2 * seen_.skin;
  if (seen_.skin > 0 && std::abs(skin_ - seen_.skin) > 0.04 * seen_.skin) {
    const auto exponent = [](double now, double before, double ratio) {
      return elementary::log((now + 1e-9) / (before + 1e-9)) / elementary::log(ratio);
    };
    candidates_exponent_ = std::clamp(exponent(candidates, seen_.candidates, reach / reach_before), 1.0, 10.0);
    rebuilds_exponent_ = std::clamp(exponent(rebuilds, seen_.rebuilds, skin_ / seen_.skin), -30.0, -1.0);
  }
  seen_ = {skin_, candidates, rebuilds};
  const double most = std::max(kLargestSkin * s.mean, short_list_skin(s));
  const auto cost = [&](double factor) {
    return kPrediction +
           candidates * elementary::pow((s.largest + 2 * skin_ * factor) / reach, candidates_exponent_) * kCandidate +
           rebuilds * elementary::pow(factor, rebuilds_exponent_) * kRenewal;
  };
  double best = 1.0, least = 0.99 * cost(1.0);
  for (const double factor : {0.8, 0.9, 1.1, 1.25}) {
    const double skin = skin_ * factor;
    const bool allowed = factor < 1 ? skin >= kSmallestSkin * s.mean : skin <= most;
    if (allowed && cost(factor) < least) least = cost(factor), best = factor;
  }
  skin_ *= best;
}

}  // namespace carom
