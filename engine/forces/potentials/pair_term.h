// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The loop over pairs, written once for all pair potentials.
//
//   V = Σ_{i<j} w_ij U(ρ_ij),   ρ_ij = d·d,   d = x_i − x_j (+ the image's shift)
//   force on i, and its negative on j:   −2 w U′ d;    mean force: −w Q(ρ, ρ′) (d + d′)
//   Hessian product on i, and its negative on j:   w [2 U′ u + 4 U″ (d·u) d],   u = w_i − w_j
//
// Q is the divided difference of U; since ρ′ − ρ = (d + d′)·(d′ − d), the mean forces are a discrete gradient.
//
// If the cutoff is longer than a periodic edge, a particle meets its own images, at separations ±d that do not change:
// ½ w_ii U for each, and so w_ii U for one of ±d. Their forces cancel; energy, virial and fluxes do not.

#include <functional>
#include <memory>
#include <utility>

#include "engine/forces/pair_formulas.h"
#include "engine/forces/potentials/pair_potentials.h"
#include "engine/forces/potentials/pairs.h"

namespace carom {

/// w_ij = 1, m_i m_j or q_i q_j.
enum class PairWeight { one, masses, charges };

/// The factors of w_ij; null: all 1.
template <int D>
const std::vector<double>* pair_factors(PairWeight weight, const Particles<D>& particles) {
  if (weight == PairWeight::one) return nullptr;
  return weight == PairWeight::masses ? &particles.mass : &particles.charge;
}

template <int D, Potential P, class Pairs>
requires PairSource<Pairs, D>
class PairTerm final : public Interaction<D> {
 public:
  /// `particles` marks ghosts and must outlive the term. `scale`: for pairs of weight 1 at a given distance.
  PairTerm(const Particles<D>& particles, P potential, PairWeight weight, Pairs pairs,
           std::function<ForceScale(double)> scale, Tail tail = {})
      : particles_(particles),
        potential_(std::move(potential)),
        weight_(weight),
        pairs_(std::move(pairs)),
        scale_(std::move(scale)),
        tail_(tail),
        batch_(std::make_unique<PairBatch>()) {}

  void add_energy(Positions<D> x, PotentialSums& sums) const override { evaluate({.x = x}, nullptr, &sums); }
  void add_fluxes(Positions<D> x, Positions<D> v, PairFluxes<D>& fluxes) const override {
    const PairBatch& batch = *batch_;
    pairs_.batches(step({.x = x}), particles_, cutoff_squared(), *batch_, [&] {
      for (unsigned r = 0; r < batch.rows; ++r)
        for (unsigned k = batch.row[r].begin; k < batch.row[r + 1].begin; ++k) {
          Vec<D> d;
          for (int axis = 0; axis < D; ++axis) d[axis] = batch.d[axis][k];
          const double rho = d.squaredNorm(), w = batch.weight[k];
          const Vec<D> force = (-2 * w * potential_.derivative(rho)) * d;
          for (int a = 0; a < D; ++a)
            for (int b = 0; b < D; ++b) fluxes.stress[D * a + b].add(d[a] * force[b]);
          for (const Id i : {pairs_.id(batch.row[r].row), pairs_.id(batch.second[k])}) {
            if (!fluxes.slab_of.empty()) fluxes.add_to_slab(i, 0.5, d * force.transpose());
            const Vec<D> current = 0.5 * (w * potential_.value(rho) * v[i] + force.dot(v[i]) * d);
            for (int axis = 0; axis < D; ++axis) fluxes.heat[axis].add(current[axis]);
          }
        }
    });
    add_own_images([&](Id i, double w, const OwnImages& images) {
      fluxes.add_to_slab(i, w, images.stress);
      const Vec<D> current = w * (images.energy * v[i] + images.stress * v[i]);
      for (int a = 0; a < D; ++a) {
        for (int b = 0; b < D; ++b) fluxes.stress[D * a + b].add(w * images.stress(a, b));
        fluxes.heat[a].add(current[a]);
      }
    });
  }
  void add_forces(Positions<D> x, ForceSums<D>& forces, PotentialSums* sums) const override {
    evaluate({.x = x}, &forces, sums);
  }
  void add_forces_early(Positions<D> x, ForceSums<D>& forces, PotentialSums* sums,
                        const Arrival& arrive) const override {
    evaluate({.x = x}, &forces, sums, 1, &arrive);
  }
  bool ages() const override {
    if constexpr (kListed) return pairs_.ages();
    return false;
  }
  void renew() const override {
    if constexpr (kListed) pairs_.renew();
  }
  void add_listed_pairs(std::span<std::uint32_t> of_particle) const override {
    if constexpr (kListed) pairs_.add_listed_pairs(of_particle);
  }
  std::uint64_t add_mean_forces(Positions<D> x, Positions<D> x_new, ForceSums<D>& forces, const char* changed,
                                int sign) const override {
    return evaluate({.x = x, .x_new = x_new, .changed = changed}, &forces, nullptr, sign);
  }

  void add_hessian_product(Positions<D> x, Positions<D> w, ForceSums<D>& out) const override {
    evaluate({.x = x, .vectors = w}, &out, nullptr);
  }

  std::unique_ptr<Interaction<D>> among(const Particles<D>& some) const override {
    auto pairs = pairs_.among(some);
    if (!pairs) return nullptr;
    auto term = std::make_unique<PairTerm>(some, potential_, weight_, std::move(*pairs), scale_, tail_);
    term->use(*kernels_);
    return term;
  }
  bool regroup() override {
    if constexpr (kListed) pairs_.regroup();
    return kListed;
  }
  void use(const PairKernels& kernels) override {
    kernels_ = &kernels;
    pairs_.use(kernels);
  }
  Tail tail() const override { return tail_; }
  bool knows_shear() const override { return pairs_.knows_shear(); }
  const PairList* bonds() const override {
    if constexpr (std::same_as<Pairs, Bonds<D>>)
      return &pairs_.list();
    else
      return nullptr;
  }
  double reach(Positions<D> x) const override { return pairs_.reach(x); }
  double reach(const Particles<D>& block, Communicator& ranks) const override { return pairs_.reach(block, ranks); }

  std::uint64_t interacting_pairs(Positions<D> x) const override {
    std::uint64_t own = 0;
    pairs_.batches(step({x}), particles_, cutoff_squared(), *batch_, [&] { own += batch_->n; });
    return own;
  }

  ForceScale scale(double distance) const override {
    ForceScale scale = scale_(distance);
    if (const auto* factor = factors()) {
      double least = std::numeric_limits<double>::infinity(), largest = 0;
      for (const double w : *factor)
        if (w != 0) least = std::min(least, w * w), largest = std::max(largest, w * w);
      if (largest == 0) return {};
      scale.spread = largest / least;
      scale.force *= least;
      scale.energy *= least;
    }
    return scale;
  }

 private:
  static constexpr bool kListed = ListedPairs<Pairs, D>;

  /// The formula from the kernels if the potential is listed; else compiled here, two lanes wide.
  const PairFormula& formula() const {
    constexpr std::size_t place = place_of<P>(PairPotentials{});
    if constexpr (place < PairPotentials::kLength) {
      return kernels_->formulas[place];
    } else {
      static constexpr PairFormula own = pair_formula<2, P>();
      return own;
    }
  }
  double cutoff_squared() const {
    if constexpr (ShortRanged<P>)
      return potential_.cutoff_squared();
    else
      return std::numeric_limits<double>::infinity();
  }
  const std::vector<double>* factors() const { return pair_factors(weight_, particles_); }
  /// Sums for unit weight over a particle's own images, one of ±d.
  struct OwnImages {
    double energy = 0, magnitude = 0;                                          // Σ U, Σ |U|
    Eigen::Matrix<double, D, D> stress = Eigen::Matrix<double, D, D>::Zero();  // Σ d_a F_b
    double nearest = std::numeric_limits<double>::infinity();                  // |d| [length]
  };
  /// Calls add(particle, weight, images) for each own particle that meets its images.
  void add_own_images(auto&& add) const {
    if constexpr (PairsWithImages<Pairs, D>) {
      OwnImages images;
      pairs_.for_each_own_image([&](const Vec<D>& d) {
        const double rho = d.squaredNorm();
        if (!(rho < cutoff_squared())) return;
        const double energy = potential_.value(rho);
        images.energy += energy;
        images.magnitude += std::abs(energy);
        images.stress += (-2 * potential_.derivative(rho)) * d * d.transpose();
        images.nearest = std::min(images.nearest, std::sqrt(rho));
      });
      if (!(images.nearest < std::numeric_limits<double>::infinity())) return;
      const auto* factor = factors();
      for (Id i = 0; i < particles_.size(); ++i)
        if (particles_.owns(i) && pairs_.takes_images_of(i)) add(i, factor ? (*factor)[i] * (*factor)[i] : 1, images);
    }
  }
  PairStep<D> step(PairStep<D> given) const {
    given.weight = factors();
    return given;
  }

  /// The loop over pairs. For mean forces, returns the number of this rank's pairs. `arrive`: not null if the positions
  /// of ghosts are unknown before this is called.
  std::uint64_t evaluate(const PairStep<D>& given, ForceSums<D>* forces, PotentialSums* sums, int sign = 1,
                         const Arrival* arrive = nullptr) const {
    const PairFormula& formula = this->formula();
    const auto& function = sums                     ? formula.forces_and_sums
                           : !given.vectors.empty() ? formula.hessian_product
                           : given.x_new.empty()    ? formula.forces
                                                    : formula.mean_forces;
    constexpr double kNoLimit = std::numeric_limits<double>::infinity();  // used without forces
    PairUnits units{.limits = {kNoLimit, kNoLimit}};
    if (sums) units.per_energy = 1 / sums->quantum;
    PairTotals totals;
    std::uint64_t own = 0;
    ForceWords* low = nullptr;
    const auto add_batch = [&] {
      if (forces && !low) {
        units.limits = forces->make_room(pairs_.most_partners());
        units.per_force = sign / forces->quantum();
        low = pairs_.low(*forces);
      }
      const bool wide = !function[0](&potential_, *batch_, units, &totals);
      if (wide && !function[1](&potential_, *batch_, units, &totals)) {
        if (given.x_new.empty() && given.vectors.empty()) refuse();
        forces->invalidate();
      } else if (forces) {
        kernels_->scatter(*batch_, batch_->low, low);
        if (wide) kernels_->scatter(*batch_, batch_->high, pairs_.high(*forces));
        if (pairs_.sheared()) [[unlikely]]
          forces->add_by_tilt(by_tilt(wide));
      }
      if (!given.x_new.empty()) own += batch_->n;
    };
    const PairStep<D> all = step(given);
    bool done = false;
    if constexpr (kListed)
      if (arrive && pairs_.own_batches(all, particles_, cutoff_squared(), *batch_, add_batch)) {
        (*arrive)();
        pairs_.rest_batches(all, particles_, cutoff_squared(), *batch_, add_batch, [&] {
          if (low) pairs_.flush_to(*forces);
          low = nullptr;
        });
        done = true;
      }
    if (!done) {
      if (arrive) (*arrive)();
      pairs_.batches(all, particles_, cutoff_squared(), *batch_, add_batch);
    }
    if (low) pairs_.flush_to(*forces);
    if (!sums) return own;
    sums->energy.add(totals.energy, sums->quantum);
    sums->magnitude.add(totals.magnitude, sums->quantum);
    sums->virial.add(totals.virial, 64 * sums->quantum);
    add_own_images([&](Id i, double w, const OwnImages& images) {
      const double virial = w * images.stress.trace();
      if (!std::isfinite(w * images.magnitude + virial))
        throw Error(Failure::numerical, "the force between particle " + std::to_string(particles_.id_of(i)) +
                                            " and its own image, " + short_text(images.nearest) +
                                            " apart, is too large or no number; use a larger box");
      sums->energy.add(w * images.energy);
      sums->magnitude.add(w * images.magnitude);
      sums->virial.add(virial);
    });
    return own;
  }

  /// −Σ n F_x of the batch in quanta, where n is the number of the image along y: the tilt moves it by n.
  typename ForceSums<D>::Whole by_tilt(bool wide) const {
    typename ForceSums<D>::Whole sum = 0;
    for (unsigned k = 0; k < batch_->n; ++k) {
      const auto above = static_cast<std::int64_t>(batch_->above[k]);
      if (above == 0) continue;
      sum -= static_cast<typename ForceSums<D>::Whole>(above) * batch_->low[0][k];
      if (wide) sum -= (static_cast<typename ForceSums<D>::Whole>(above) * batch_->high[0][k]) << kHighShift;
    }
    return sum;
  }

  /// Names the pair of the batch with the largest force, or one with a NaN force.
  [[noreturn]] void refuse() const {
    unsigned worst = 0;
    double largest = -1, apart = 0;
    for (unsigned k = 0; k < batch_->n; ++k) {
      const auto& d = batch_->d;
      const double rho = d[0][k] * d[0][k] + d[1][k] * d[1][k] + d[2][k] * d[2][k];
      const double size = std::abs(batch_->weight[k] * potential_.derivative(rho)) * std::sqrt(rho);
      if (size <= largest) continue;
      worst = k;
      apart = std::sqrt(rho);
      if (!(size >= 0)) break;
      largest = size;
    }
    const Id i = pairs_.id(batch_->first_of(worst)), j = pairs_.id(batch_->second[worst]);
    const auto name = [&](Id k) { return std::to_string(particles_.id_of(k)); };
    throw Error(Failure::numerical, "the force between particles " + name(std::min(i, j)) + " and " +
                                        name(std::max(i, j)) + ", " + short_text(apart) +
                                        " apart, is too large or no number; use a smaller integrator.step, or place "
                                        "them farther apart");
  }

  const Particles<D>& particles_;
  P potential_;
  PairWeight weight_;
  Pairs pairs_;
  std::function<ForceScale(double)> scale_;
  Tail tail_;
  const PairKernels* kernels_ = &widest_kernels<PairKernels>();
  std::unique_ptr<PairBatch> batch_;
};

}  // namespace carom
