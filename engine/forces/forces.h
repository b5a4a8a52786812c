// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Sums over all interactions of a system.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "engine/laws/counters.h"
#include "engine/ranks/step_account.h"
#include "engine/ranks/system.h"

namespace carom {

/// Computes the quanta from parameters, masses, charges and box. Collective.
template <int D>
Quanta quanta(const System<D>& system) {
  constexpr double kNoScale = std::numeric_limits<double>::infinity();
  const double distance = mean_distance(system);
  std::array<double, 4> most = {-kNoScale, -kNoScale, 0, 0};  // −smallest force and energy; largest force and energy
  for (const auto& term : system.interactions) {
    const ForceScale scale = term->scale(distance);
    if (scale.force > 0) most[0] = std::max(most[0], -scale.force);
    if (scale.energy > 0) most[1] = std::max(most[1], -scale.energy);
    most[2] = std::max(most[2], scale.spread * scale.force);
    most[3] = std::max(most[3], scale.spread * scale.energy);
  }
  system.decomposition.ranks().largest(most);
  const auto power = [](double x) { return x < kNoScale ? std::ldexp(1.0, std::ilogb(std::max(x, 0x1p-900))) : 1; };
  // The second bound lets the largest forces and energies fit.
  return {std::max(0x1p-44 * power(-most[0]), 0x1p-66 * power(most[2])),
          std::max(0x1p-46 * power(-most[1]), 0x1p-70 * power(most[3]))};
}

/// The quanta set at the start of the run, or computed if they are not set.
template <int D>
Quanta quanta_of(const System<D>& system) {
  return system.quanta.force > 0 ? system.quanta : quanta(system);
}

/// One force pass: `add` adds the terms of each interaction, `out` gets the sums; if `arrive` is given, it is called at
/// the latest after them, and the sums on ghosts remain unknown.
template <int D, class Add>
void force_pass(const System<D>& system, Vectors<D> out, ForceSums<D>& forces, Counters& counters, Add&& add,
                const Arrival& arrive = {}) {
  const Stopwatch watch(counters.seconds.force);
  for (const auto& term : system.interactions) add(*term);
  if (arrive) arrive();
  system.decomposition.add_ghosts(forces);
  for (Id i = 0; i < out.size(); ++i) out[i] = forces.value(i);
  if (!arrive) system.decomposition.copy_to_ghosts(out);
  counters.force_passes += 1;
}

/// out[i] = force on particle i at positions x. If `sums` is given, sets it to V and the other sums over what this rank
/// owns. If `arrive` is given, the positions of ghosts are unknown until arrive() has been called, and the forces on
/// them remain so. One force pass.
template <int D>
void evaluate_forces(const System<D>& system, Positions<D> x, Vectors<D> out, Counters& counters,
                     PotentialSums* sums = nullptr, const Arrival& arrive = {}) {
  if (sums) *sums = {.quantum = quanta_of(system).energy};
  ForceSums<D> forces(x.size(), quanta_of(system).force);
  bool waits = static_cast<bool>(arrive);
  const Arrival once = [&] {
    if (std::exchange(waits, false)) arrive();
  };
  const auto add = [&](const auto& term) { term.add_forces_early(x, forces, sums, once); };
  force_pass<D>(system, out, forces, counters, add, arrive ? once : Arrival());
  if (sums && system.box.sheared()) sums->by_tilt = forces.by_tilt();
}

/// out[i] = −∇̄_i V(x, x_new), the mean force of a discrete-gradient step. One force pass.
template <int D>
void evaluate_mean_forces(const System<D>& system, Positions<D> x, Positions<D> x_new, Vectors<D> out,
                          Counters& counters) {
  ForceSums<D> forces(x.size(), quanta_of(system).force);
  force_pass<D>(system, out, forces, counters, [&](const auto& term) { term.add_mean_forces(x, x_new, forces); });
}

/// Mean forces over a step, for repeated corrections of its end that change only a few particles.
template <int D>
class MeanForces {
 public:
  /// Evaluates all pairs. Returns the number of this rank's pairs within reach.
  std::uint64_t evaluate(const System<D>& system, Positions<D> x, Positions<D> x_new) {
    forces_.reset(x.size(), quanta_of(system).force);
    std::uint64_t pairs = 0;
    for (const auto& term : system.interactions) pairs += term->add_mean_forces(x, x_new, forces_);
    room_ = system.decomposition.add_ghosts(forces_);
    return pairs;
  }
  /// Evaluates changes only, with the bits of evaluate(); x_new may differ from that of the last call, `x_before`, only
  /// for `changed` particles.
  std::uint64_t update(const System<D>& system, Positions<D> x, Positions<D> x_before, Positions<D> x_new,
                       const char* changed) {
    // The sums have room for hundreds of changes. How many, depends on the lists, so their renewal does not count.
    if (!room_) evaluate(system, x, x_before);
    if (!room_) return evaluate(system, x, x_new);  // invalid sums
    std::uint64_t pairs = 0;
    for (const auto& term : system.interactions) {
      pairs += term->add_mean_forces(x, x_before, forces_, changed, -1);
      pairs += term->add_mean_forces(x, x_new, forces_, changed);
    }
    room_ = system.decomposition.add_ghosts(forces_);
    return pairs;
  }
  /// The force on an own particle.
  Vec<D> operator[](Id i) const { return forces_.value(i); }
  /// ForceSums::by_tilt().
  ExactSum by_tilt() const { return forces_.by_tilt(); }

 private:
  ForceSums<D> forces_;
  bool room_ = false;  // for changes, in the sums of all ranks
};

/// out = V″(x) w. One force pass.
template <int D>
void evaluate_hessian_product(const System<D>& system, Positions<D> x, Positions<D> w, Vectors<D> out,
                              Counters& counters) {
  double most = 0;
  for (Id i = 0; i < w.size(); ++i)
    if (system.particles.owns(i)) most = std::max(most, w[i].template lpNorm<Eigen::Infinity>());
  most = system.decomposition.largest(most);
  // Particles are displaced by a fraction of their mean distance; the quantum of forces is scaled by it.
  const double share = most > 0 && std::isfinite(most) ? most / mean_distance(system) : 1;
  ForceSums<D> sums(x.size(), std::ldexp(quanta_of(system).force, std::ilogb(share) + 2));
  force_pass<D>(system, out, sums, counters, [&](const auto& term) { term.add_hessian_product(x, w, sums); });
}

/// V, Σ|V| and the virial at x of what this rank owns, as exact sums; not counted as a force pass.
template <int D>
PotentialSums own_energy(const System<D>& system, Positions<D> x) {
  PotentialSums sums{.quantum = quanta_of(system).energy};
  for (const auto& term : system.interactions) term->add_energy(x, sums);
  return sums;
}
/// The same of all particles. Collective.
template <int D>
PotentialSums evaluate_energy(const System<D>& system, Positions<D> x) {
  return system.decomposition.sum(own_energy(system, x));
}

/// The exact sum of term(i) over all particles of all ranks. Collective.
template <int D>
double sum_over_all(const System<D>& system, auto&& term) {
  ExactSeries own;
  for (Id i = 0; i < system.particles.size(); ++i)
    if (system.particles.owns(i)) own.add(term(i));
  return system.decomposition.sum(own.sum()).value();
}

/// The velocity of the centre of mass if particles can move relative to it without changing it: if there are several,
/// and momentum is conserved; else zero. Collective.
template <int D>
Vec<D> velocity_of_centre(const System<D>& system) {
  Vec<D> centre = Vec<D>::Zero();
  if (system.size() < 2 || !system.keeps_momentum()) return centre;
  const auto& p = system.particles;
  const double mass = sum_over_all<D>(system, [&](Id i) { return p.mass[i]; });
  for (int k = 0; k < D; ++k) centre[k] = sum_over_all<D>(system, [&](Id i) { return p.mass[i] * p.v[i][k]; }) / mass;
  return centre;
}

/// Exact sums and extremes over all particles.
template <int D>
struct MotionSums {
  ExactSum kinetic;                  ///< ½ m v² [energy]
  ExactSum rotational;               ///< ½ I ω² if contacts are rough [energy]
  ExactSum speed;                    ///< |v| [length/time]
  std::array<ExactSum, D> momentum;  ///< m v [mass·length/time]
  double fastest = 0;                ///< largest |v| [length/time]
  double farthest = 0;               ///< largest coordinate [length]
  StepAccount steps{};               ///< the steps of pairs

  void add(const MotionSums& other) {
    kinetic.add(other.kinetic);
    rotational.add(other.rotational);
    speed.add(other.speed);
    for (int k = 0; k < D; ++k) momentum[k].add(other.momentum[k]);
    fastest = std::max(fastest, other.fastest);
    farthest = std::max(farthest, other.farthest);
    steps.add(other.steps);
  }
};

/// Sums over this rank's own particles: the momentum in `state`, the rest in `at`. `near`: for own_steps().
/// Collective if pairs have steps.
template <int D>
MotionSums<D> own_motion(const System<D>& system, const Particles<D>& state, const Particles<D>& at,
                         NeighbourList<D>* near = nullptr) {
  ExactSeries kinetic, speed;
  std::array<ExactSeries, D> momentum;
  double fastest = 0, farthest = 0;
  for (Id i = 0; i < at.size(); ++i) {
    if (!system.particles.owns(i)) continue;
    const double squared = at.v[i].squaredNorm();
    kinetic.add(0.5 * moving_mass(at.mass[i]) * squared);
    speed.add(std::sqrt(squared));
    fastest = std::max(fastest, squared);
    farthest = std::max(farthest, at.x[i].cwiseAbs().maxCoeff());
    for (int k = 0; k < D; ++k) momentum[k].add(moving_mass(state.mass[i]) * state.v[i][k]);
  }
  MotionSums<D> sums{kinetic.sum(), {}, speed.sum(), {}, std::sqrt(fastest), farthest, own_steps(system, at, near)};
  if (system.box.contacts.rough()) {
    ExactSeries rotational;
    for (Id i = 0; i < at.size(); ++i)
      if (system.particles.owns(i))
        rotational.add(0.5 * system.box.contacts.moment(at.species[i], moving_mass(at.mass[i]), at.radius[i], D) *
                       at.spin[i].squaredNorm());
    sums.rotational = rotational.sum();
  }
  for (int k = 0; k < D; ++k) sums.momentum[k] = momentum[k].sum();
  return sums;
}

/// The G of the shadow Hamiltonian S_h = H + h² G that kick-drift-kick Verlet conserves to second order: G = (1/12) vᵀ
/// V″ v − (1/24) ∇Vᵀ M⁻¹ ∇V (Hairer, Lubich, Wanner, Geometric Numerical Integration, IX.3). `a` must be −M⁻¹∇V(x);
/// `scratch` is overwritten. One force pass.
template <int D>
double shadow_term(const System<D>& system, const Particles<D>& at, Positions<D> a, Vectors<D> scratch,
                   Counters& counters) {
  std::vector<Vec<D>> v = at.v;  // some methods advance own particles only
  system.decomposition.copy_to_ghosts(std::span(v));
  evaluate_hessian_product<D>(system, at.x, v, scratch, counters);
  ExactSeries sum;
  for (Id i = 0; i < at.size(); ++i) {
    if (!system.particles.owns(i)) continue;
    sum.add(at.v[i].dot(scratch[i]) / 12);
    sum.add(-moving_mass(at.mass[i]) * a[i].squaredNorm() / 24);
  }
  return system.decomposition.sum(sum.sum()).value();
}

}  // namespace carom
