// SPDX-License-Identifier: BSD-3-Clause
#include "engine/search/neighbour_list.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/base/error.h"
#include "engine/search/sized_cells.h"

namespace carom {

namespace {
constexpr std::size_t kMaxPairs = 10'000'000,
                      kMaxPairsPerParticle = 200;  // per particle; only far too long a step gives more

double mean(const std::vector<double>& of) {
  return std::accumulate(of.begin(), of.end(), 0.0) / static_cast<double>(std::max<std::size_t>(1, of.size()));
}
}  // namespace

template <int D>
NeighbourList<D>::NeighbourList(const Box<D>& box, std::vector<double> reach, std::span<const char> without,
                                std::vector<char> fixed)
    : box_(box),
      reach_(std::move(reach)),
      without_(without),
      fixed_(std::move(fixed)),
      skin_(0.3 * mean(reach_), 6, 1.6 * mean(reach_)) {}  // at least 15 % of a mean pair reach

template <int D>
std::span<const NeighbourPair<D>> NeighbourList<D>::cover(std::span<const Vec<D>> x, std::span<const Vec<D>> x_new,
                                                          double margin) {
  if (box_.tilt != built_with_tilt_) built_at_.clear();  // the images have moved
  const bool known = built_at_.size() == x.size(), still = x.data() == x_new.data();
  std::vector<Image<D>> crossed;
  double squared_from_build = 0, squared_step = 0;  // the largest over all particles
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (known) {
      follow_wrap(static_cast<Id>(i), x, crossed);
      squared_from_build = std::max(squared_from_build, (x[i] - built_at_[i]).squaredNorm());
    }
    if (still) continue;
    if (known) squared_from_build = std::max(squared_from_build, (x_new[i] - built_at_[i]).squaredNorm());
    squared_step = std::max(squared_step, (x_new[i] - x[i]).squaredNorm());
  }
  if (!crossed.empty())
    for (auto& pair : pairs_)  // all images of a pair change by the same number: the order is kept
      for (int k = 0; k < D; ++k) pair.image[k] += crossed[pair.i][k] - crossed[pair.j][k];
  const double step = std::sqrt(squared_step) + margin, from_build = std::sqrt(squared_from_build);
  if (!skin_.lasts(known, from_build, step, margin)) {
    skin_.renew(box_, step, [] { return std::string("a particle"); });
    if (build(x)) return pairs_;
    skin_.begin(2 * step);  // too many pairs with a wider skin
    if (build(x)) return pairs_;
    skin_.begin(0);
    built_at_.clear();
    throw Error(Failure::numerical, "a particle may come " + short_text(step) +
                                        " far within one step, which gives far too many candidates for collisions; use "
                                        "a smaller integrator.step");
  }
  return pairs_;
}

template <int D>
const Partners& NeighbourList<D>::partners() {
  if (partners_.empty())
    partners_.build(reach_.size(), pairs_.size(), [&](std::size_t k) {
      return std::array<Id, 2>{pairs_[k].i, pairs_[k].j};
    });
  return partners_;
}

/// Detects whether particle i was wrapped since the last call: stores the jump and moves its position at the build
/// along.
template <int D>
void NeighbourList<D>::follow_wrap(Id i, std::span<const Vec<D>> x, std::vector<Image<D>>& crossed) {
  const Image<D> jump = box_.nearest_image(x[i] - built_at_[i]);
  if (jump == Image<D>{}) return;
  if (crossed.empty()) crossed.resize(x.size());
  crossed[i] = jump;
  built_at_[i] -= box_.shift(jump);
}

/// Returns false if there are far too many pairs.
template <int D>
bool NeighbourList<D>::build(std::span<const Vec<D>> x) {
  need_finite_positions<D>(x);
  ++rebuilds_;
  built_at_.assign(x.begin(), x.end());
  built_with_tilt_ = box_.tilt;
  pairs_.clear();
  partners_.clear();
  SizedCells<D> cells(box_, reach_, Extent<D>(x), skin_.width());
  for (Id i = 0; i < x.size(); ++i) cells.insert(i, x[i], reach_[i]);
  for (Id i = 0; i < x.size(); ++i) {
    if (!without_.empty() && without_[i] != 0) continue;
    const std::size_t first = pairs_.size();
    cells.for_each_near(x[i], reach_[i], [&](Id j, const Image<D>& image) {
      if (j <= i || (!fixed_.empty() && fixed_[i] != 0 && fixed_[j] != 0)) return;
      const Vec<D> d = x[i] - x[j] + box_.shift(image);
      const double reach = reach_[i] + reach_[j] + skin_.width();
      if (d.squaredNorm() <= reach * reach) pairs_.push_back({i, j, image});
    });
    std::sort(pairs_.begin() + static_cast<std::ptrdiff_t>(first), pairs_.end());
    if (pairs_.size() > kMaxPairs + kMaxPairsPerParticle * x.size()) return false;
  }
  return true;
}

template class NeighbourList<2>;
template class NeighbourList<3>;

}  // namespace carom
