// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The fluxes of momentum and energy through the whole box, for the pressure tensor and the transport coefficients:
//
//   S = Σ m v v + Σ d F + Σ d J δ(t − t_c),   Q = Σ e v + ½ Σ d F·(v_i + v_j) + Σ d ΔE δ(t − t_c),
//
// with e = ½ m v² + ½ Σ V (the energy of steps included), sums over particles, over pairs (d = x_i − x_j of each image
// within the cutoff, F the force on i) and over collisions (J the impulse on i, ΔE the energy that i gets, d of the
// image that is touched).
//
// The integrals over time are sums of what passes during each interval. They are not differences of Σ m x v_y and
// Σ e x, which are no functions of the state in a periodic box (Erpenbeck, Phys. Rev. E 51 (1995) 4296). Σ m v v and
// Σ e v are integrated by the trapezoidal rule between samples, and their jump at a collision is weighted with the time
// that is left of the interval. In flights without forces they change at collisions only, so that the integrals are
// exact. With forces the integrals are of second order in the interval, apart from the jumps of Σ d F·v at collisions,
// which are not weighted.
//
// Rank 0 gets the collisions in the order of their keys and collects the particles, so that the bits do not depend on
// the ranks.

#include <algorithm>
#include <cmath>

#include "engine/forces/forces.h"
#include "engine/run/measurement.h"
#include "engine/run/observable.h"

namespace carom::observable {

template <int D>
using Tensor = Eigen::Matrix<double, D, D>;

/// A particle as rank 0 needs it.
template <int D>
struct Traveller {
  Id id;
  std::uint16_t species;
  double mass;  // 0: fixed
  double charge;
  Vec<D> x, v;  // x unwrapped
};

/// All particles on rank 0 in the order of their ids; nothing on other ranks. Collective.
template <int D>
std::vector<Traveller<D>> travellers(const System<D>& system, const Particles<D>& p) {
  std::vector<Traveller<D>> all;
  Bytes mine;
  Communicator* const others = system.decomposition.others();
  for (Id i = 0; i < p.size(); ++i) {
    if (!p.owns(i)) continue;
    Traveller<D> one{
        p.id_of(i), p.species[i], moving_mass(p.mass[i]), p.charge[i], p.x[i] + system.box.shift(p.image[i]), p.v[i]};
    if (others)
      put(mine, one);
    else
      all.push_back(one);
  }
  if (!others) return all;
  for (const Bytes& bytes : gather_on_first(*others, std::move(mine)))
    for (Reader reader(bytes); reader.more();) all.push_back(reader.get<Traveller<D>>());
  std::ranges::sort(all, {}, &Traveller<D>::id);
  return all;
}

/// The fluxes of a state, or their integrals.
template <int D>
struct Fluxes {
  Tensor<D> kinetic = Tensor<D>::Zero(), forces = Tensor<D>::Zero(), contacts = Tensor<D>::Zero();
  Vec<D> heat = Vec<D>::Zero();

  void add(double factor, const Fluxes& other) {
    kinetic += factor * other.kinetic;
    forces += factor * other.forces;
    contacts += factor * other.contacts;
    heat += factor * other.heat;
  }
  void add_kinetic(double mass, const Vec<D>& v, double sign = 1) {
    kinetic += sign * mass * v * v.transpose();
    heat += (0.5 * sign * mass * v.squaredNorm()) * v;
  }
};

/// Integrates the fluxes from sample to sample, on rank 0. Velocities are relative to the centre of mass at the first
/// sample if `relative`.
template <int D>
class FluxIntegral {
 public:
  FluxIntegral(const System<D>& system, bool relative) : system_(system), relative_(relative) {}

  void add(double slab_start, std::span<const Contact<D>> contacts) {
    if (mass_.empty()) return;  // before the first sample, or not on rank 0
    const bool steps = !of_steps_.empty();
    for (const Contact<D>& each : contacts) {
      const bool pair = each.key.kind == EventKind::pair;
      Fluxes<D> jump;
      // Returns the kinetic energy that i gets.
      const auto bounced = [&](Id i, const Vec<D>& v, const Vec<D>& impulse) {
        if (!(mass_[i] > 0)) return 0.0;
        const Vec<D> after = v - drift_, before = after - impulse / mass_[i];
        jump.add_kinetic(mass_[i], after);
        jump.add_kinetic(mass_[i], before, -1);
        if (steps) {
          jump.heat -= of_steps_[i] * before;
          of_steps_[i] += 0.5 * each.exchange.stored;
          jump.heat += of_steps_[i] * after;
        }
        return 0.5 * impulse.dot(before + after);
      };
      const double gained = bounced(each.key.lo, each.v_lo, each.impulse);
      jumps_.add(1, jump);
      moments_.add(slab_start + each.key.time - time_, jump);
      if (!pair) continue;
      jump = {};
      const double other = bounced(each.key.hi, each.v_hi, -each.impulse);
      jumps_.add(1, jump);
      moments_.add(slab_start + each.key.time - time_, jump);
      const Vec<D> d = each.x_lo - each.x_hi;
      jumps_.contacts += d * each.impulse.transpose();
      transferred_ += (0.5 * (gained - other)) * d;  // each partner also gets half of what a step stores
    }
  }

  /// Makes the energy of steps part of the heat flux. `energies`: what step_energies() says at the first sample. Call
  /// this before the first to().
  void add_steps(std::vector<double> energies) { of_steps_ = std::move(energies); }

  /// The integrals over the time since the last sample; zero at the first one, and on other ranks than the first.
  /// Collective.
  Fluxes<D> to(double time, const Particles<D>& particles, std::span<const Traveller<D>> all) {
    const bool first = mass_.empty();
    if (first && !all.empty()) {
      double mass = 0;
      drift_.setZero();
      for (const Traveller<D>& each : all) {
        mass_.push_back(each.mass);
        drift_ += each.mass * each.v;
        mass += each.mass;
      }
      drift_ = relative_ ? Vec<D>(drift_ / mass) : Vec<D>(Vec<D>::Zero());
    }
    Fluxes<D> now;
    for (const Traveller<D>& each : all) {
      now.add_kinetic(each.mass, each.v - drift_);
      if (!of_steps_.empty()) now.heat += of_steps_[each.id] * (each.v - drift_);
    }
    add_forces(particles, now);
    const double h = time - time_;
    Fluxes<D> sum;
    if (!first) {
      sum.add(0.5 * h, last_);
      sum.add(0.5 * h, now);
      sum.add(0.5 * h, jumps_);
      sum.add(-1, moments_);
      sum.contacts = jumps_.contacts;
      sum.heat += transferred_;
    }
    last_ = now;
    time_ = time;
    jumps_ = moments_ = {};
    transferred_.setZero();
    return sum;
  }
  const Vec<D>& drift() const { return drift_; }

  void archive(Archive& archive) {
    archive(mass_, time_, last_, jumps_, moments_, drift_, transferred_);
    if (!system_.box.steps.empty()) archive(of_steps_);
  }

 private:
  void add_forces(const Particles<D>& particles, Fluxes<D>& now) {
    if (system_.interactions.empty()) return;
    std::vector<Vec<D>> v(particles.v);
    Communicator* const others = system_.decomposition.others();
    const Vec<D> drift = others ? gather_values<Vec<D>>(*others, {&drift_, 1})[0] : drift_;  // only rank 0 knows it
    for (Vec<D>& each : v) each -= drift;
    system_.decomposition.copy_to_ghosts(std::span(v));  // some methods advance own particles only
    PairFluxes<D> own;
    for (const auto& term : system_.interactions) term->add_fluxes(particles.x, v, own);
    if (others) own = sum_of_all(*others, own);
    for (int a = 0; a < D; ++a) {
      for (int b = 0; b < D; ++b) now.forces(a, b) = own.stress[D * a + b].value();
      now.forces(a, a) += tail_of(system_).virial / D;
      now.heat[a] += own.heat[a].value();
    }
  }

  const System<D>& system_;
  bool relative_;
  std::vector<double> mass_;      // by id; 0: fixed
  std::vector<double> of_steps_;  // by id: the energy of its steps; empty without add_steps()
  double time_ = 0;               // of the last sample
  Fluxes<D> last_;                // then
  Fluxes<D> jumps_, moments_;     // Σ of the jumps since then, Σ of the jumps times the times since then
  Vec<D> drift_ = Vec<D>::Zero(), transferred_ = Vec<D>::Zero();
};

}  // namespace carom::observable
