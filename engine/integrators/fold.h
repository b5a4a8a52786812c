#pragma once
// Small changes of the kinetic energy, spread over velocities so that momentum stays: each velocity, relative to the
// centre of mass, is stretched by √(1 + r/K).

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "engine/forces/forces.h"

namespace carom::integrator {

/// s of v ← v + s (v − centre), which changes a kinetic energy K by r = share · K.
inline double stretch(double share) { return share / (1 + std::sqrt(1 + share)); }

/// Adds what all ranks lack, and `more`, to the kinetic energy of all particles relative to `centre`; nothing where
/// they have too little. Collective.
template <int D>
void fold(System<D>& system, const Vec<D>& centre, const ExactSum& lack, double more, Counters& counters) {
  struct Sums {
    ExactSum lack, kinetic;
    void add(const Sums& other) { lack.add(other.lack), kinetic.add(other.kinetic); }
  };
  Particles<D>& p = system.particles;
  ExactSeries kinetic;
  for (Id i = 0; i < p.size(); ++i)
    if (p.owns(i)) kinetic.add(0.5 * p.mass[i] * (p.v[i] - centre).squaredNorm());
  const Sums sums = system.decomposition.sum(Sums{lack, kinetic.sum()});
  const double r = sums.lack.value() + more, share = r / sums.kinetic.value();
  if (!(std::abs(share) < 0.5) || share == 0) return;
  const double s = stretch(share);
  for (auto& v : p.v) v += s * (v - centre);
  counters.folded += std::abs(r);
}

/// What one particle lacks.
template <int D>
struct Lack {
  Id id;     ///< as all ranks know it
  Vec<D> x;  ///< where it is
  double r;  ///< [energy]
};

/// Adds each r to the kinetic energy of the particle and those nearest to it, relative to their centre of mass: of 16,
/// or of more, up to 64, until it is no more than a tenth of what these have. `mine`: of particles that this rank owns,
/// by ascending id. Returns what is left over where all were too few. The velocities of own particles change.
/// Collective.
template <int D>
double fold_near(System<D>& system, const std::vector<Lack<D>>& mine, Counters& counters) {
  constexpr std::size_t kLeast = 16, kMost = 64;
  constexpr double kShare = 0.1;
  struct Near {
    std::size_t lack;  ///< its number
    double squared_distance;
    Id id;
    double mass;
    Vec<D> v;
    bool operator<(const Near& other) const {
      return std::pair(squared_distance, id) < std::pair(other.squared_distance, other.id);
    }
  };
  Communicator& ranks = system.decomposition.ranks();
  Particles<D>& p = system.particles;
  std::vector<Lack<D>> lacks = gather_values<Lack<D>>(ranks, mine);
  if (lacks.empty()) return 0;
  counters.frozen += lacks.size();
  std::ranges::sort(lacks, {}, &Lack<D>::id);

  std::vector<std::vector<Near>> near(lacks.size());
  std::vector<Near> own;
  for (std::size_t k = 0; k < lacks.size(); ++k) {
    for (Id j = 0; j < p.size(); ++j) {
      if (!p.owns(j)) continue;
      const Vec<D> d = p.x[j] - lacks[k].x;
      near[k].push_back(
          {k, (d + system.box.shift(system.box.nearest_image(d))).squaredNorm(), p.id_of(j), p.mass[j], p.v[j]});
    }
    const std::size_t most = std::min(kMost, near[k].size());
    std::ranges::partial_sort(near[k], near[k].begin() + static_cast<std::ptrdiff_t>(most), std::less<>{});
    near[k].resize(most);
    own.insert(own.end(), near[k].begin(), near[k].end());
    near[k].clear();
  }
  for (const Near& each : gather_values<Near>(ranks, own)) near[each.lack].push_back(each);

  std::map<Id, Vec<D>> changed;
  const auto velocity = [&](const Near& each) {
    const auto at = changed.find(each.id);
    return at == changed.end() ? each.v : at->second;
  };
  double left = 0;
  for (std::size_t k = 0; k < lacks.size(); ++k) {
    std::ranges::sort(near[k], std::less<>{});
    double share = 1;
    Vec<D> centre;
    std::size_t size = std::min(kLeast, near[k].size());
    for (;; size = std::min(2 * size, near[k].size())) {
      double mass = 0, kinetic = 0;
      centre.setZero();
      for (std::size_t n = 0; n < size; ++n) {
        mass += near[k][n].mass;
        centre += near[k][n].mass * velocity(near[k][n]);
      }
      centre /= mass;
      for (std::size_t n = 0; n < size; ++n)
        kinetic += 0.5 * near[k][n].mass * (velocity(near[k][n]) - centre).squaredNorm();
      share = lacks[k].r / kinetic;
      if (std::abs(share) <= kShare || size >= std::min(kMost, near[k].size())) break;
    }
    if (!(std::abs(share) <= kShare)) {
      left += lacks[k].r;
      continue;
    }
    counters.folded += std::abs(lacks[k].r);
    for (std::size_t n = 0; n < size; ++n) {
      const Vec<D> v = velocity(near[k][n]);
      changed[near[k][n].id] = v + stretch(share) * (v - centre);
    }
  }
  for (Id j = 0; j < p.size(); ++j)
    if (const auto at = changed.find(p.id_of(j)); at != changed.end()) p.v[j] = at->second;
  return left;
}

}  // namespace carom::integrator
