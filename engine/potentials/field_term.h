#pragma once
// The loop over particles, written once for all external fields.
//
// A field offers, for particle i at x,
//   value(i, x)                    V_i
//   gradient(i, x)                 ∇V_i
//   mean_gradient(i, x, x_new)     a discrete gradient: · (x_new − x) = V_i(x_new) − V_i(x)
//   hessian_product(i, x, w)       V_i″ w
//   among(particles)               itself for other particles
// and, where it accelerates everybody alike, acceleration().

#include <algorithm>
#include <utility>

#include "engine/interaction.h"

namespace carom {

template <int D, class Field>
class FieldTerm final : public Interaction<D> {
 public:
  /// `particles` tells who is a ghost, and outlives the term.
  FieldTerm(const Particles<D>& particles, Field field) : particles_(particles), field_(std::move(field)) {}

  void add_energy(Positions<D> x, PotentialSums& sums) const override {
    for (Id i = 0; i < x.size(); ++i) {
      if (!particles_.owns(i)) continue;
      const double v = field_.value(i, x[i]);
      sums.energy.add(v);
      sums.magnitude.add(std::abs(v));
    }
  }
  void add_forces(Positions<D> x, Vectors<D> force) const override {
    for (Id i = 0; i < x.size(); ++i) force[i] -= field_.gradient(i, x[i]);
  }
  void add_mean_forces(Positions<D> x, Positions<D> x_new, Vectors<D> force) const override {
    for (Id i = 0; i < x.size(); ++i) force[i] -= field_.mean_gradient(i, x[i], x_new[i]);
  }
  void add_hessian_product(Positions<D> x, Positions<D> w, Vectors<D> out) const override {
    for (Id i = 0; i < x.size(); ++i) out[i] += field_.hessian_product(i, x[i], w[i]);
  }
  PairCounts add_impulses(const Histories<D>& paths, PairMemory<D>& memory, Vectors<D> impulse) const override {
    const auto particles = static_cast<Id>(paths.particles());
    PairCounts counts;
    for (Id i = 0; i < particles; ++i) {
      add_impulses_on(paths, i, memory, impulse);
      if (!particles_.owns(i)) continue;
      ++counts.pairs;
      for (std::uint32_t n = i; n != Histories<D>::kNone; n = paths.next[n]) ++counts.evaluations;
    }
    return counts;
  }
  bool remembers() const override { return true; }
  std::uint64_t renew_impulses(const Histories<D>&, std::span<const Id> changed, PairMemory<D>&,
                               std::vector<Id>&) const override {
    return static_cast<std::uint64_t>(std::ranges::count_if(changed, [&](Id i) { return particles_.owns(i); }));
  }
  void add_impulses_on(const Histories<D>& paths, Id i, const PairMemory<D>&, Vectors<D> impulse) const override {
    for (std::uint32_t n = i; n != Histories<D>::kNone; n = paths.next[n]) {
      const double time = paths.duration(n);
      impulse[n] -= time * field_.mean_gradient(i, paths.x[n], paths.x[n] + time * paths.chord[n]);
    }
  }
  std::uint64_t add_trapezoids(const Histories<D>& paths, Id i, double end, Vec<D>& impulse,
                               Vec<D>& force) const override {
    const std::uint32_t n = paths.last[i];
    const Vec<D> before = field_.gradient(i, paths.x[n]), after = field_.gradient(i, paths.position_in(n, end));
    impulse -= (0.5 * (end - paths.start[n])) * (before + after);
    force -= after;
    return 2;
  }
  std::uint64_t add_corrections(const Histories<D>& paths, Id i, Vectors<D> impulse) const override {
    const std::uint32_t n = paths.last[i];
    const Vec<D> first = field_.gradient(i, paths.x[i]), before = field_.gradient(i, paths.x[n]);
    const Vec<D> after = field_.gradient(i, paths.position_in(n, paths.length));
    impulse[i] += (0.5 * paths.length) * (first + after) - (0.5 * paths.duration(n)) * (before + after);
    return 3;
  }
  std::uint64_t interacting_pairs(Positions<D> x) const override {
    std::uint64_t owned = 0;
    for (Id i = 0; i < x.size(); ++i) owned += particles_.owns(i) ? 1 : 0;
    return owned;
  }
  const Vec<D>* common_acceleration() const override {
    if constexpr (requires { field_.acceleration(); })
      return &field_.acceleration();
    else
      return nullptr;
  }
  bool keeps_momentum() const override { return false; }
  std::unique_ptr<Interaction<D>> among(const Particles<D>&, const Particles<D>& some) const override {
    return std::make_unique<FieldTerm>(some, field_.among(some));
  }
  double reach(Positions<D>) const override { return 0; }
  double reach(const Particles<D>&, Exchange&) const override { return 0; }

 private:
  const Particles<D>& particles_;
  Field field_;
};

}  // namespace carom
