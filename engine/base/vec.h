// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The vector type of the whole engine.

#include <Eigen/Core>
#include <array>
#include <cstdint>

namespace carom {

/// A point, displacement, velocity or force in D dimensions.
template <int D>
using Vec = Eigen::Matrix<double, D, 1>;

/// The number of a particle in the deck's order; it never changes.
using Id = std::uint32_t;

/// How often a particle or a pair has crossed each periodic axis.
template <int D>
using Image = std::array<std::int32_t, D>;

}  // namespace carom
