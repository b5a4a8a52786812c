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
  template <int D>
  UnitWeight among(const Particles<D>&, const Particles<D>&) const {
    return {};
  }
};

/// w_ij = m_i m_j or q_i q_j. The vector outlives the term.
class ProductWeight {
 public:
  explicit ProductWeight(const std::vector<double>& factor) : factor_(&factor) {}
  double operator()(Id i, Id j) const { return (*factor_)[i] * (*factor_)[j]; }
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
  PairTerm(const Particles<D>& particles, P potential, Weight weight, Pairs pairs)
      : particles_(particles), potential_(std::move(potential)), weight_(weight), pairs_(std::move(pairs)) {}

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

  void begin_slab(Positions<D> x, double margin) const override { pairs_.begin_slab(x, margin); }

  PairCounts add_impulses(const Histories<D>& paths, PairMemory<D>& memory, Vectors<D> impulse) const override {
    const bool first = memory.impulse.empty();
    if constexpr (Pairs::kRemembered) memory.impulse.resize(pairs_.pairs_in_slab());
    memory.stretches.swap(memory.stretches_before);
    memory.stretches.clear();
    PairCounts counts;
    std::size_t pair = 0;
    Vec<D> unremembered;
    pairs_.for_each_in_slab(paths.x, [&](Id i, Id j, const auto& shift) {
      Vec<D>& kept = Pairs::kRemembered ? memory.impulse[pair++] : unremembered;
      if (foreign(i, j)) return;
      const bool known = Pairs::kRemembered && !first && !paths.changed[i] && !paths.changed[j];
      std::uint64_t evaluations = 0;
      if (paths.simple(i) && paths.simple(j)) {
        if (!known) kept = impulse_on_lower(paths, i, j, shift, evaluations);
        impulse[i] += kept;
        impulse[j] -= kept;
      } else {
        const auto fresh = static_cast<std::ptrdiff_t>(memory.stretches.size());
        if (known) {
          const auto from = memory.stretches_before.begin() + static_cast<std::ptrdiff_t>(kept[0]);
          paths.for_each_stretch(i, j, [&, at = from](auto...) mutable { memory.stretches.push_back(*at++); });
        } else {
          push_stretches(paths, i, j, shift, memory.stretches, evaluations);
        }
        kept[0] = static_cast<double>(fresh);
        auto at = memory.stretches.begin() + fresh;
        paths.for_each_stretch(i, j, [&](std::uint32_t m, std::uint32_t n, double, double) {
          impulse[m] += *at;
          impulse[n] -= *at++;
        });
        if constexpr (!Pairs::kRemembered) memory.stretches.clear();
      }
      if (evaluations == 0 || !particles_.owns(i)) return;
      counts.evaluations += evaluations;
      ++counts.pairs;
    });
    return counts;
  }

  bool remembers() const override { return Pairs::kRemembered; }

  std::uint64_t renew_impulses(const Histories<D>& paths, std::span<const Id> changed, PairMemory<D>& memory,
                               std::vector<Id>& partners) const override {
    std::uint64_t owned = 0;
    for (const Id i : changed)
      pairs_.for_each_partner_in_slab(paths.x, i, [&](Id partner, const auto& shift, std::uint32_t pair) {
        partners.push_back(partner);
        if ((partner < i && paths.changed[partner]) || foreign(i, partner)) return;
        const Id lo = std::min(i, partner), hi = std::max(i, partner);
        std::uint64_t evaluations = 0;
        Vec<D>& kept = memory.impulse[pair];
        if (paths.simple(lo) && paths.simple(hi)) {
          kept = impulse_on_lower(paths, lo, hi, shift, evaluations);
        } else {
          kept[0] = static_cast<double>(memory.stretches.size());
          push_stretches(paths, lo, hi, shift, memory.stretches, evaluations);
        }
        if (particles_.owns(lo)) owned += evaluations;
      });
    return owned;
  }

  void add_impulses_on(const Histories<D>& paths, Id i, const PairMemory<D>& memory,
                       Vectors<D> impulse) const override {
    pairs_.for_each_partner_in_slab(paths.x, i, [&](Id partner, const auto&, std::uint32_t pair) {
      const Vec<D>& kept = memory.impulse[pair];
      if (paths.simple(i) && paths.simple(partner)) {
        if (i < partner)
          impulse[i] += kept;
        else
          impulse[i] -= kept;
        return;
      }
      auto at = memory.stretches.begin() + static_cast<std::ptrdiff_t>(kept[0]);
      paths.for_each_stretch(std::min(i, partner), std::max(i, partner),
                             [&](std::uint32_t m, std::uint32_t n, double, double) {
                               if (i < partner)
                                 impulse[m] += *at++;
                               else
                                 impulse[n] -= *at++;
                             });
    });
  }

  std::uint64_t add_trapezoids(const Histories<D>& paths, Id i, double end, Vec<D>& impulse,
                               Vec<D>& force) const override {
    std::uint64_t evaluations = 0;
    const std::uint32_t m = paths.last[i];
    pairs_.for_each_partner_in_slab(paths.x, i, [&](Id j, const auto& shift, std::uint32_t) {
      auto on_i = [&](std::uint32_t n, double t) -> Vec<D> {
        const Vec<D> on_lower = i < j ? force_at(paths, i, j, m, n, t, shift, evaluations)
                                      : force_at(paths, j, i, n, m, t, shift, evaluations);
        return i < j ? on_lower : -on_lower;
      };
      double from = paths.start[m];
      std::uint32_t n = paths.at(j, from);
      Vec<D> before = on_i(n, from);
      while (from < end) {
        const double to = std::min(paths.end(n), end);
        const Vec<D> after = on_i(n, to);
        impulse += (0.5 * (to - from)) * (before + after);
        before = after;
        from = to;
        if (to < end) n = paths.next[n];
      }
      force += before;
    });
    return evaluations;
  }

  std::uint64_t add_corrections(const Histories<D>& paths, Id i, Vectors<D> impulse) const override {
    std::uint64_t evaluations = 0;
    pairs_.for_each_partner_in_slab(paths.x, i, [&](Id partner, const auto& shift, std::uint32_t) {
      if (partner < i && !paths.simple(partner)) return;
      const Id lo = std::min(i, partner), hi = std::max(i, partner);
      const Vec<D> first = force_at(paths, lo, hi, lo, hi, 0, shift, evaluations);
      Vec<D> before = first, on_lo = Vec<D>::Zero(), on_hi = Vec<D>::Zero();
      paths.for_each_stretch(lo, hi, [&](std::uint32_t m, std::uint32_t n, double from, double to) {
        const Vec<D> after = force_at(paths, lo, hi, m, n, to, shift, evaluations);
        const Vec<D> given = (0.5 * (to - from)) * (before + after);
        if (paths.next[m] == Histories<D>::kNone) on_lo += given;
        if (paths.next[n] == Histories<D>::kNone) on_hi -= given;
        before = after;
      });
      const Vec<D> whole = (0.5 * paths.length) * (first + before);
      impulse[lo] += on_lo - whole;
      impulse[hi] += on_hi + whole;
    });
    return evaluations;
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
    return std::make_unique<PairTerm>(some, potential_, weight_.among(made_for, some), std::move(*pairs));
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

  /// The impulse on i of the pair (i, j), i < j, over a stretch that begins at separation d; moves d on to its end.
  Vec<D> over_stretch(Id i, Id j, Vec<D>& d, const Vec<D>& u, double time, std::uint64_t& evaluations) const {
    const Vec<D> d_new = d + time * u, sum = d + d_new;
    const double rho = d.squaredNorm(), rho_new = d_new.squaredNorm();
    d = d_new;
    if (out_of_reach(rho) && out_of_reach(rho_new)) return Vec<D>::Zero();
    ++evaluations;
    return (-time * weight_(i, j) * potential_.quotient(rho, rho_new)) * sum;
  }
  /// Over the whole slab, where neither has inner nodes.
  template <class Shift>
  Vec<D> impulse_on_lower(const Histories<D>& paths, Id i, Id j, const Shift& shift, std::uint64_t& evaluations) const {
    Vec<D> d = separation<D>(paths.x[i], paths.x[j], shift);
    return over_stretch(i, j, d, paths.chord[i] - paths.chord[j], paths.length, evaluations);
  }
  template <class Shift>
  void push_stretches(const Histories<D>& paths, Id i, Id j, const Shift& shift, std::vector<Vec<D>>& stretches,
                      std::uint64_t& evaluations) const {
    Vec<D> d = separation<D>(paths.x[i], paths.x[j], shift);
    paths.for_each_stretch(i, j, [&](std::uint32_t m, std::uint32_t n, double from, double to) {
      stretches.push_back(over_stretch(i, j, d, paths.chord[m] - paths.chord[n], to - from, evaluations));
    });
  }

  /// The force on i of the pair (i, j), i < j, at time t, which belongs to the intervals m of i and n of j.
  template <class Shift>
  Vec<D> force_at(const Histories<D>& paths, Id i, Id j, std::uint32_t m, std::uint32_t n, double t, const Shift& shift,
                  std::uint64_t& evaluations) const {
    const Vec<D> d = separation<D>(paths.position_in(m, t), paths.position_in(n, t), shift);
    const double rho = d.squaredNorm();
    if (out_of_reach(rho)) return Vec<D>::Zero();
    ++evaluations;
    return (-2 * weight_(i, j) * potential_.derivative(rho)) * d;
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
};

}  // namespace carom
