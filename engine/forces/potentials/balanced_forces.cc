// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/potentials/balanced_forces.h"

#include <cmath>

namespace carom {
namespace {

/// Integer sums over all particles of the components of a force, each in two words, and a count of impossible ones.
struct WholeForce {
  using Whole = ForceSums<3>::Whole;
  std::array<std::uint64_t, 7> word{};

  /// Returns `quanta`, rounded down and added to component k; a number too large is counted instead.
  std::int64_t add(std::size_t k, double quanta) {
    if (!(std::abs(quanta) < 0x1p61)) return ++word[6], 0;
    const auto whole = static_cast<std::int64_t>(std::floor(quanta));
    word[2 * k] += static_cast<std::uint64_t>(whole & 0xffffffff);
    word[2 * k + 1] += static_cast<std::uint64_t>(whole >> 32);
    return whole;
  }
  Whole operator[](std::size_t k) const {
    return (static_cast<Whole>(static_cast<std::int64_t>(word[2 * k + 1])) << 32) + static_cast<Whole>(word[2 * k]);
  }
  bool possible() const { return word[6] == 0; }
};

}  // namespace

BalancedForces balanced(const std::vector<Vec<3>>& f, std::span<const Id> some, const Particles<3>& particles, Id first,
                        double quantum, const std::function<double(Id)>& share, Communicator& ranks) {
  std::vector<std::array<std::int64_t, 3>> rounded(some.size());
  WholeForce net, shares;
  for (std::size_t n = 0; n < some.size(); ++n)
    for (int k = 0; k < 3; ++k) rounded[n][k] = net.add(k, std::nearbyint(f[some[n]][k] / quantum));
  ranks.sum(net.word);
  for (std::size_t n = 0; n < some.size(); ++n) {
    const double part = share(some[n]);
    // Multiples of the golden ratio: in any number of consecutive ids nearly the right number is rounded up.
    const double up = static_cast<double>((particles.id_of(some[n]) * 0x9e3779b97f4a7c15U) >> 11U) * 0x1p-53;
    for (int k = 0; k < 3; ++k) rounded[n][k] -= shares.add(k, static_cast<double>(net[k]) * part + up);
  }
  ranks.sum(shares.word);
  if (!net.possible() || !shares.possible()) return std::nullopt;
  for (std::size_t n = 0; n < some.size(); ++n)
    if (particles.id_of(some[n]) == first)
      for (int k = 0; k < 3; ++k) rounded[n][k] -= static_cast<std::int64_t>(net[k] - shares[k]);
  return rounded;
}

bool add(const BalancedForces& balanced, std::span<const Id> some, ForceSums<3>& forces, int sign) {
  constexpr std::int64_t kHalf = std::int64_t{1} << 31;  // both parts of a sum of quanta are exact as doubles
  const ForceLimits limits = forces.make_room(2);
  if (!balanced) return false;
  for (std::size_t n = 0; n < some.size(); ++n) {
    Vec<3> upper, lower;
    for (int k = 0; k < 3; ++k) {
      const std::int64_t whole = (*balanced)[n][k], low = whole % kHalf;
      upper[k] = static_cast<double>(whole - low);
      lower[k] = static_cast<double>(low);
    }
    for (const Vec<3>& part : {upper, lower})
      if (!forces.add(some[n], sign * forces.quantum() * part, limits)) return false;
  }
  return true;
}

}  // namespace carom
