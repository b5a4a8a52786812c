#pragma once
// The loop over pairs, written once for all pair potentials.
//
//   V = Σ_{i<j} w_ij U(ρ_ij),   ρ_ij = d·d,   d = x_i − x_j (+ the image's shift)
//   force on i, minus that on j:   −2 w U′ d;    mean force: −w Q(ρ, ρ′) (d + d′)
//   Hessian product, on i, minus that on j:   w [2 U′ u + 4 U″ (d·u) d],   u = w_i − w_j
//
// Q is the divided difference of U; since ρ′ − ρ = (d + d′)·(d′ − d), the mean forces are a discrete gradient.

#include <utility>

#include "engine/potentials/pairs.h"
#include "engine/potentials/potential.h"

namespace carom {

/// w_ij = 1.
struct UnitWeight {
  double operator()(Id, Id) const { return 1; }
  double of(Id) const { return 1; }
  template <int D>
  UnitWeight among(const Particles<D>&, const Particles<D>&) const {
    return {};
  }
};

/// w_ij = m_i m_j or q_i q_j. The vector outlives the term.
class ProductWeight {
 public:
  explicit ProductWeight(const std::vector<double>& factor) : factor_(&factor) {}
  double operator()(Id i, Id j) const { return of(i) * of(j); }
  double of(Id i) const { return (*factor_)[i]; }
  /// The same property of other particles.
  template <int D>
  ProductWeight among(const Particles<D>& made_for, const Particles<D>& some) const {
    return ProductWeight(factor_ == &made_for.mass ? some.mass : some.charge);
  }

 private:
  const std::vector<double>* factor_;
};

template <int D, Potential P, class Weight, class Pairs>
class PairTerm final : public Interaction<D> {
 public:
  /// `particles` tells who is a ghost, and outlives the term.
  PairTerm(const Particles<D>& particles, P potential, Weight weight, Pairs pairs, Tail tail = {})
      : particles_(particles),
        potential_(std::move(potential)),
        weight_(weight),
        pairs_(std::move(pairs)),
        tail_(tail) {}

  void add_energy(Positions<D> x, PotentialSums& sums) const override {
    // Pairs come with ascending i: what belongs to one i is summed in that order, and exactly from there on.
    struct Partial {
      double energy = 0, magnitude = 0, virial = 0;
    } partial;
    Id owner = 0;
    auto pass_on = [&] {
      sums.energy.add(partial.energy);
      sums.magnitude.add(partial.magnitude);
      sums.virial.add(partial.virial);
      partial = {};
    };
    for_each_within_reach(x, [&](Id i, Id j, const Vec<D>&, double rho) {
      if (!particles_.owns(i)) return;
      if (i != owner) pass_on();
      owner = i;
      const double weight = weight_(i, j), v = weight * potential_.value(rho);
      partial.energy += v;
      partial.magnitude += std::abs(v);
      partial.virial -= 2 * weight * potential_.derivative(rho) * rho;
    });
    pass_on();
  }

  void add_forces(Positions<D> x, Vectors<D> force) const override {
    for_each_within_reach(x, [&](Id i, Id j, const Vec<D>& d, double rho) {
      const Vec<D> f = (2 * weight_(i, j) * potential_.derivative(rho)) * d;
      force[i] -= f;
      force[j] += f;
    });
  }

  void add_mean_forces(Positions<D> x, Positions<D> x_new, Vectors<D> force) const override {
    pairs_.for_each(x, x_new, [&](Id i, Id j, const auto& shift) {
      if (foreign(i, j)) return;
      const Vec<D> d = separation<D>(x[i], x[j], shift), d_new = separation<D>(x_new[i], x_new[j], shift);
      const double rho = d.squaredNorm(), rho_new = d_new.squaredNorm();
      if (out_of_reach(rho) && out_of_reach(rho_new)) return;
      const Vec<D> f = (weight_(i, j) * potential_.quotient(rho, rho_new)) * (d + d_new);
      force[i] -= f;
      force[j] += f;
    });
  }

  void add_hessian_product(Positions<D> x, Positions<D> w, Vectors<D> out) const override {
    for_each_within_reach(x, [&](Id i, Id j, const Vec<D>& d, double rho) {
      const Vec<D> u = w[i] - w[j];
      const Vec<D> product =
          weight_(i, j) * (2 * potential_.derivative(rho) * u + 4 * potential_.second_derivative(rho) * d.dot(u) * d);
      out[i] += product;
      out[j] -= product;
    });
  }

  std::unique_ptr<Interaction<D>> among(const Particles<D>& made_for, const Particles<D>& some) const override {
    auto pairs = pairs_.among(some);
    if (!pairs) return nullptr;
    return std::make_unique<PairTerm>(some, potential_, weight_.among(made_for, some), std::move(*pairs), tail_);
  }
  Tail tail() const override { return tail_; }
  const PairList* bonds() const override {
    if constexpr (requires { pairs_.list(); })
      return &pairs_.list();
    else
      return nullptr;
  }
  double reach(Positions<D> x) const override { return pairs_.reach(x); }
  double reach(const Particles<D>& share, Exchange& ranks) const override { return pairs_.reach(share, ranks); }

  std::uint64_t interacting_pairs(Positions<D> x) const override {
    std::uint64_t within = 0;
    for_each_within_reach(x, [&](Id i, Id, const Vec<D>&, double) { within += particles_.owns(i) ? 1 : 0; });
    return within;
  }

 private:
  /// Whether a pair is nobody's whom this rank owns.
  bool foreign(Id i, Id j) const { return !particles_.owns(i) && !particles_.owns(j); }

  bool out_of_reach(double rho) const {
    if constexpr (ShortRanged<P>)
      return rho >= potential_.cutoff_squared();
    else
      return false;
  }

  template <class Visit>
  void for_each_within_reach(Positions<D> x, Visit&& visit) const {
    pairs_.for_each(x, x, [&](Id i, Id j, const auto& shift) {
      const Vec<D> d = separation<D>(x[i], x[j], shift);
      const double rho = d.squaredNorm();
      if (!out_of_reach(rho) && !foreign(i, j)) visit(i, j, d, rho);
    });
  }

  const Particles<D>& particles_;
  P potential_;
  Weight weight_;
  Pairs pairs_;
  Tail tail_;
};

}  // namespace carom
