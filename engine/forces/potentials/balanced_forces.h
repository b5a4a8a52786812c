// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Forces in fixed point whose sum over the particles of all ranks is exactly zero, though they were not computed in
// pairs.

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "engine/base/force_sums.h"
#include "engine/base/particles.h"
#include "engine/ranks/communicator.h"

namespace carom {

/// Forces on some particles of this rank [quanta]; none if one of any rank is too large or no number.
using BalancedForces = std::optional<std::vector<std::array<std::int64_t, 3>>>;

/// The forces f, by particle [force], on these particles of this rank, rounded to quanta: each gives up share(particle)
/// of their sum over all ranks, rounded up or down by its id, and that with the lowest id, `first`, what remains. The
/// shares of all ranks add up to 1. Collective.
BalancedForces balanced(const std::vector<Vec<3>>& f, std::span<const Id> some, const Particles<3>& particles, Id first,
                        double quantum, const std::function<double(Id)>& share, Communicator& ranks);

/// Adds them, times `sign`. Returns false if there are none, or if a sum becomes too large.
bool add(const BalancedForces& balanced, std::span<const Id> some, ForceSums<3>& forces, int sign);

}  // namespace carom
