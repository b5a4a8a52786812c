// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Cells for particles of very different sizes: one grid for each factor of two in reach, because cells for the largest
// particle would hold thousands of small ones. They are correct in any box; the event core has faster cells.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/search/cell_grid.h"

namespace carom {

template <int D>
class SizedCells {
 public:
  /// Two particles are neighbours if their distance is at most the sum of their reaches and `skin` [length]. `extent`
  /// has the bounds of the positions, which matter along open axes. The cells are empty at first.
  SizedCells(const Box<D>& box, std::span<const double> reach, const Extent<D>& extent, double skin = 0)
      : skin_(skin), largest_(reach.empty() ? 0 : *std::ranges::max_element(reach)), places_(reach.size()) {
    std::array<std::size_t, kLevels> members{};
    std::array<double, kLevels> largest{};
    for (const double r : reach) {
      const std::size_t o = octave(r);
      ++members[o];
      largest[o] = std::max(largest[o], r);
    }
    for (std::size_t o = 0; o < kLevels; ++o) {
      level_[o] = levels_.size();
      if (members[o] > 0)
        levels_.emplace_back(largest[o],
                             CellGrid<D>(box, 2 * largest[o] + skin, {members[o], extent.low, extent.high}));
    }
  }

  void insert(Id i, const Vec<D>& x, double reach) {
    Level& level = levels_[level_[octave(reach)]];
    const Cell<D> cell = level.grid.cell(x);
    std::uint32_t& first = level.first[level.grid.index(cell)];
    places_[i] = {std::exchange(first, i), level.grid.boxes(cell)};
  }

  /// Calls visit(j, image) for every particle j in the cells (including a particle at x) whose image at x_j −
  /// shift(image) may touch a particle with this reach at x.
  template <class Visit>
  void for_each_near(const Vec<D>& x, double reach, Visit&& visit) const {
    for (const Level& level : levels_) {
      const Cell<D> range = level.grid.range(reach + level.largest + skin_);
      const auto look = [&](std::size_t first, std::size_t end, const Image<D>& away) {
        for (std::size_t cell = first; cell < end; ++cell)
          for (std::uint32_t j = level.first[cell]; j != kNoParticle; j = places_[j].next) {
            Image<D> image = places_[j].boxes;
            for (int k = 0; k < D; ++k) image[k] -= away[k];
            visit(j, image);
          }
      };
      level.grid.for_each_range(level.grid.cell(x), range, false, look);
    }
  }

 private:
  static constexpr std::size_t kLevels = 8;  // the last one holds all smaller particles
  static constexpr std::uint32_t kNoParticle = std::numeric_limits<std::uint32_t>::max();

  struct Level {
    Level(double reach, const CellGrid<D>& cells) : largest(reach), grid(cells), first(cells.cells(), kNoParticle) {}
    double largest;
    CellGrid<D> grid;
    std::vector<std::uint32_t> first;  // by cell
  };
  struct Place {
    std::uint32_t next;  // in the cell
    Image<D> boxes;      // relative to the box that holds the origin
  };

  std::size_t octave(double reach) const {
    if (reach > 0.5 * largest_) return 0;
    return reach > 0 ? std::min(static_cast<std::size_t>(std::ilogb(largest_ / reach)), kLevels - 1) : kLevels - 1;
  }

  double skin_, largest_;
  std::vector<Level> levels_;
  std::array<std::size_t, kLevels> level_;  // by octave
  std::vector<Place> places_;               // by particle
};

/// Throws Error(Failure::numerical) if a position is not finite.
template <int D>
void need_finite_positions(std::span<const Vec<D>> x) {
  for (std::size_t i = 0; i < x.size(); ++i)
    if (!x[i].allFinite())
      throw Error(Failure::numerical,
                  "the position of particle " + std::to_string(i) + " is not finite; use a smaller integrator.step");
}

/// Calls visit(i, j, image), j < i, once for each pair of particles that may touch: the distance of x_i from
/// x_j − shift(image) may be the sum of their reaches. Pairs in which particle i is marked in `without` are left out,
/// and pairs in which both are marked in `fixed`; empty marks leave out none. Throws Error(Failure::numerical) if a
/// position is not finite. One visit of all pairs costs far less than a NeighbourList.
template <int D, class Visit>
void visit_close_pairs(const Box<D>& box, std::span<const Vec<D>> x, std::span<const double> reach,
                       std::span<const char> without, std::span<const char> fixed, Visit&& visit) {
  need_finite_positions<D>(x);
  SizedCells<D> cells(box, reach, Extent<D>(x));
  for (Id i = 0; i < x.size(); ++i) {
    const auto look = [&](Id j, const Image<D>& image) {
      if (fixed.empty() || fixed[i] == 0 || fixed[j] == 0) visit(i, j, image);
    };
    if (without.empty() || without[i] == 0) cells.for_each_near(x[i], reach[i], look);
    cells.insert(i, x[i], reach[i]);
  }
}

}  // namespace carom
