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

/// An angular velocity, angular momentum or torque: about z in two dimensions.
template <int D>
using Spin = Vec<D == 2 ? 1 : 3>;

/// w × r, the velocity of the point r of a body that turns about the origin.
template <int D>
Vec<D> turned(const Spin<D>& w, const Vec<D>& r) {
  if constexpr (D == 2)
    return {-w[0] * r[1], w[0] * r[0]};
  else
    return {w[1] * r[2] - w[2] * r[1], w[2] * r[0] - w[0] * r[2], w[0] * r[1] - w[1] * r[0]};
}

/// r × f, the torque of a force f that acts at r.
template <int D>
Spin<D> torque(const Vec<D>& r, const Vec<D>& f) {
  if constexpr (D == 2)
    return Spin<D>::Constant(r[0] * f[1] - r[1] * f[0]);
  else
    return turned<D>(r, f);
}

/// The number of a particle in the deck's order; it never changes.
using Id = std::uint32_t;

/// How often a particle or a pair has crossed each periodic axis.
template <int D>
using Image = std::array<std::int32_t, D>;

}  // namespace carom
