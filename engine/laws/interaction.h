// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Forces between and on the particles besides their hard cores: the smooth part V of H = ½ vᵀMv + V(x).
//
// An Interaction is one term of V: a pair potential over a list of bonds or over all pairs within a cutoff, or an
// external field. It computes V, its gradient, its discrete gradient and products with its Hessian, each in one loop
// over the particles. Arrays of positions are in id order. Forces, energies and virials are summed in fixed point
// (force_sums.h), so no sum depends on how the pairs were found.
//
// If a system is divided among ranks (engine/ranks/decomposition.h), sums over the system run over what this rank
// evaluates: its particles, pairs of them, and some of their pairs with ghosts (Particles::evaluates). Forces on
// ghosts must then be added to those on the particles of their owners (Decomposition::add_ghosts). A term in which each
// particle feels all others, as the waves of an Ewald sum, adds up sums of all ranks in add_…(): all ranks call these
// functions in the same order.

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/exact_sum.h"
#include "engine/base/force_sums.h"
#include "engine/base/parameters.h"
#include "engine/base/particles.h"
#include "engine/laws/box.h"

namespace carom {

class BondTable;
class Communicator;
struct PairKernels;

template <int D>
using Positions = std::span<const Vec<D>>;
template <int D>
using Vectors = std::span<Vec<D>>;

/// Waits until the positions of ghosts have arrived; further calls do nothing.
using Arrival = std::function<void()>;

/// Sums over one evaluation of V, exact and so independent of the order of summation.
struct PotentialSums {
  ExactSum energy{};     ///< V [energy]
  ExactSum magnitude{};  ///< Σ|V| over pairs and particles [energy]
  ExactSum virial{};     ///< Σ d·F over pairs, d = x_i − x_j, F the force on i, without external fields [energy]
  ExactSum by_tilt{};    ///< ∂V/∂tilt in a sheared box, if forces were evaluated too [force]
  double quantum = 0x1p-46;  ///< the terms of each pair of two particles are rounded to a multiple of it [energy]

  void add(const PotentialSums& other) {
    energy.add(other.energy);
    magnitude.add(other.magnitude);
    virial.add(other.virial);
    by_tilt.add(other.by_tilt);
  }
};

/// What the pairs of a state contribute to the fluxes of momentum and energy, as exact sums.
template <int D>
struct PairFluxes {
  std::array<ExactSum, std::size_t{D} * D>
      stress{};                    ///< Σ d_a F_b over pairs, d and F as in PotentialSums [energy]; index D a + b
  std::array<ExactSum, D> heat{};  ///< ½ Σ [V + d F·] (v_i + v_j) over pairs [energy·length/time]
  /// The slab in which each particle is, if the stress in slabs is wanted, and Σ ½ d_a F_b of the particles in each.
  std::span<const std::uint32_t> slab_of{};
  std::vector<std::array<ExactSum, std::size_t{D} * D>> in_slab{};

  void add(const PairFluxes& other) {
    for (std::size_t k = 0; k < stress.size(); ++k) stress[k].add(other.stress[k]);
    for (std::size_t k = 0; k < heat.size(); ++k) heat[k].add(other.heat[k]);
    in_slab.resize(std::max(in_slab.size(), other.in_slab.size()));
    for (std::size_t s = 0; s < other.in_slab.size(); ++s)
      for (std::size_t k = 0; k < stress.size(); ++k) in_slab[s][k].add(other.in_slab[s][k]);
  }
  void archive(auto& archive) { archive(stress, heat, in_slab); }
  /// Adds a particle's part of the stress to its slab.
  void add_to_slab(std::uint32_t i, double factor, const Eigen::Matrix<double, D, D>& part) {
    if (slab_of.empty() || slab_of[i] >= in_slab.size()) return;
    for (int a = 0; a < D; ++a)
      for (int b = 0; b < D; ++b) in_slab[slab_of[i]][D * a + b].add(factor * part(a, b));
  }
};

/// A constant correction to the reported V (engine/forces/potentials/tail.h).
struct Tail {
  double energy = 0;  ///< [energy]
  double virial = 0;  ///< as in PotentialSums [energy]
};

template <int D>
class Interaction {
 public:
  virtual ~Interaction() = default;

  /// Adds V and the other sums at positions x.
  virtual void add_energy(Positions<D> x, PotentialSums& sums) const = 0;

  /// Adds the fluxes at positions x and velocities v; external fields have none.
  /// Throws Error(Failure::deck) if the term has no formula for its stress.
  virtual void add_fluxes(Positions<D> x, Positions<D> v, PairFluxes<D>& fluxes) const = 0;

  /// Adds −∂V/∂x_i for each particle; if `sums` is given, adds V and the other sums to it. Throws
  /// Error(Failure::numerical), which names the particles, if a force is not finite or too large to be summed.
  virtual void add_forces(Positions<D> x, ForceSums<D>& forces, PotentialSums* sums = nullptr) const = 0;
  /// The same where the positions of ghosts are unknown until arrive() has been called; what does not depend on them
  /// can be added before.
  virtual void add_forces_early(Positions<D> x, ForceSums<D>& forces, PotentialSums* sums,
                                const Arrival& arrive) const {
    arrive();
    add_forces(x, forces, sums);
  }

  /// Whether this rank's list of pairs will be too old in the next step, and the order to make a new one in this step:
  /// ranks that make their lists in the same steps wait less for each other.
  virtual bool ages() const { return false; }
  virtual void renew() const {}
  /// Adds to each particle the number of its pairs in the last list, where a pair counts for one of its particles only,
  /// which this rank owns.
  virtual void add_listed_pairs(std::span<std::uint32_t> /*of_particle*/) const {}

  /// Adds −∇̄_i V(x, x_new), the discrete gradient: Σ_i ∇̄_i V·(x_new_i − x_i) = V(x_new) − V(x) (Gonzalez 1996; for
  /// pairs the distance quotient of LaBudde and Greenspan). A pair keeps the periodic image it has at x. `changed`:
  /// only pairs with at least one changed particle, and fields on changed particles (a term in which each particle
  /// feels all others adds all its forces); sign −1 subtracts exactly what +1 added in the last call, and calls no
  /// other rank. Returns the number of this rank's pairs (or particles, for a field) within reach. A trial step may be
  /// far too long: forces that are not finite or too large invalidate the sums.
  virtual std::uint64_t add_mean_forces(Positions<D> x, Positions<D> x_new, ForceSums<D>& forces,
                                        const char* changed = nullptr, int sign = 1) const = 0;

  /// Adds V″(x) w.
  virtual void add_hessian_product(Positions<D> x, Positions<D> w, ForceSums<D>& out) const = 0;

  /// This term for the subset `some` of the particles, which must outlive it. Null if the subset lacks particles that
  /// act on owned ones.
  virtual std::unique_ptr<Interaction> among(const Particles<D>& some) const = 0;
  /// The particles for which this term was made have been replaced by others, in the same arrays. False if it must be
  /// made again by among(). A term that can go on keeps the memory of its lists.
  virtual bool regroup() { return false; }
  /// The particles are divided among these ranks, which a term with sums over all particles needs.
  virtual void join(Communicator& /*ranks*/) {}
  /// The distance from x within which other particles matter, as far as this rank knows [length]; infinite: all
  /// particles do.
  virtual double reach(Positions<D> x) const = 0;
  /// The reach of a term that was made for a block of the particles; the largest one of all ranks counts. Collective.
  virtual double reach(const Particles<D>& block, Communicator& ranks) const = 0;

  /// The number of this rank's pairs (or particles, for a field) within reach in one evaluation: the unit of
  /// `force_passes`.
  virtual std::uint64_t interacting_pairs(Positions<D> x) const = 0;

  /// The acceleration, if this term gives all particles the same constant one; else null. Free flight integrates this
  /// field exactly.
  virtual const Vec<D>* common_acceleration() const { return nullptr; }

  /// The estimated contribution beyond the cutoff, of all particles, on each rank.
  virtual Tail tail() const { return {}; }

  /// What a user should know about this term, and what to do about it; empty if there is nothing.
  struct Caution {
    std::string what, remedy;
  };
  virtual Caution caution() const { return {}; }

  /// The bonds of this term, by ids, if it was made for all particles or a block; null if it has none.
  virtual const PairList* bonds() const { return nullptr; }

  /// The size of its forces at this mean distance between particles [length], from parameters and this rank's
  /// particles.
  virtual ForceScale scale(double distance) const = 0;

  /// Uses these kernels, which give the same bits, instead of the widest of this machine. Fields use no kernels.
  virtual void use(const PairKernels&) {}

  /// Whether the term acts through images that slide, in a sheared box.
  virtual bool knows_shear() const { return false; }

  /// Whether the term is invariant under translation, so that it conserves the total momentum.
  virtual bool keeps_momentum() const { return true; }
};

/// The context in which an interaction is made. The box and particles must outlive it.
template <int D>
struct InteractionContext {
  const Box<D>& box;
  const Particles<D>& particles;
  const std::vector<std::string>& species;   ///< names, in the order of Particles::species
  bool placed = true;                        ///< whether positions are known; if not, only the parameters are checked
  std::size_t total = particles.size();      ///< number of particles on all ranks; `particles` may be a block of them
  Communicator* ranks = nullptr;             ///< the ranks that hold the blocks; null: all particles are here
  std::shared_ptr<const BondTable> bonds{};  ///< bonds of all terms; null: there are none
};

/// The declaration of one type of interaction; engine/forces/potentials/registry.cc lists them all.
struct InteractionInfo {
  enum class Kind { bonded, pair, field };
  std::string_view name;  ///< as in the deck: `type = "…"`
  Kind kind;
  std::vector<Parameter> parameters;
  std::string_view formula;        ///< V in the notation of the docs
  std::string_view documentation;  ///< a paragraph for the manual
  std::string_view source;         ///< paper or book
  std::unique_ptr<Interaction<2>> (*in_2d)(const Parameters&, const InteractionContext<2>&);
  std::unique_ptr<Interaction<3>> (*in_3d)(const Parameters&, const InteractionContext<3>&);

  template <int D>
  std::unique_ptr<Interaction<D>> make(const Parameters& values, const InteractionContext<D>& context) const {
    if constexpr (D == 2)
      return in_2d(values, context);
    else
      return in_3d(values, context);
  }
};

/// All types of interaction, in the order of the manual.
const std::vector<InteractionInfo>& interactions();

/// The declaration of this type; throws Error(Failure::deck), which lists the names, if there is none.
const InteractionInfo& find_interaction(std::string_view name);

}  // namespace carom
