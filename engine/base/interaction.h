// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// What acts between and on the particles besides their hard cores: the smooth part V of H = ½ vᵀMv + V(x).
//
// An Interaction is one term of V: a pair potential over a list of bonds or over all pairs within a cutoff, or an
// external field. It offers V, its gradient, its discrete gradient and its second derivative, each as a whole loop over
// the particles. Positions are passed in as arrays in id order. Forces, energies and virials are summed in fixed point
// (force_sums.h): no sum depends on how the pairs were found.
//
// Where several ranks share a system (engine/ranks/decomposition.h) sums over the system are over what this rank owns:
// its particles, and the pairs of which it owns the lower id. What acts on a ghost is left incomplete.

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/box.h"
#include "engine/base/exact_sum.h"
#include "engine/base/force_sums.h"
#include "engine/base/parameters.h"
#include "engine/base/particles.h"

namespace carom {

class BondTable;
class Communicator;
struct PairKernels;

template <int D>
using Positions = std::span<const Vec<D>>;
template <int D>
using Vectors = std::span<Vec<D>>;

/// Sums over one evaluation of V; exact, so that they do not depend on the order of summation.
struct PotentialSums {
  ExactSum energy{};     ///< V [energy]
  ExactSum magnitude{};  ///< Σ|V| over pairs and particles [energy]
  ExactSum virial{};  ///< Σ d·F over pairs, d = x_i − x_j, F the force on i [energy]; external fields add nothing
  double quantum = 0x1p-46;  ///< of pairs: each pair's terms are rounded to a multiple of it [energy]

  void add(const PotentialSums& other) {
    energy.add(other.energy);
    magnitude.add(other.magnitude);
    virial.add(other.virial);
  }
};

/// A constant that is added to what is reported of V (engine/forces/potentials/tail.h).
struct Tail {
  double energy = 0;  ///< [energy]
  double virial = 0;  ///< as in PotentialSums [energy]
};

template <int D>
class Interaction {
 public:
  virtual ~Interaction() = default;

  /// V and its companions at positions x.
  virtual void add_energy(Positions<D> x, PotentialSums& sums) const = 0;

  /// Adds −∂V/∂x_i for each particle, and where `sums` is given V and its companions. Throws
  /// Error(Failure::numerical) where a force is not finite or too large to be summed, and names its particles.
  virtual void add_forces(Positions<D> x, ForceSums<D>& forces, PotentialSums* sums = nullptr) const = 0;

  /// Adds −∇̄_i V(x, x_new), the discrete gradient: Σ_i ∇̄_i V·(x_new_i − x_i) = V(x_new) − V(x) (Gonzalez 1996; for
  /// pairs the distance quotient of LaBudde and Greenspan). A pair keeps the periodic image it has at x. `changed`:
  /// only pairs with at least one such particle, and fields on these; sign −1: subtracts exactly what +1 has added.
  /// Returns the number of pairs (or particles, for a field) of this rank within reach. A step that is only tried may
  /// be far too long: forces that are not finite or too large invalidate the sums.
  virtual std::uint64_t add_mean_forces(Positions<D> x, Positions<D> x_new, ForceSums<D>& forces,
                                        const char* changed = nullptr, int sign = 1) const = 0;

  /// Adds V″(x) w.
  virtual void add_hessian_product(Positions<D> x, Positions<D> w, ForceSums<D>& out) const = 0;

  /// The same term for `some` of all particles, which outlive it. Null where they are not enough for those of them that
  /// are owned.
  virtual std::unique_ptr<Interaction> among(const Particles<D>& some) const = 0;
  /// How far it reaches from positions x, as far as this rank knows [length]; infinite: it needs all particles.
  virtual double reach(Positions<D> x) const = 0;
  /// The same of a term that was made for a block of the particles. Collective.
  virtual double reach(const Particles<D>& block, Communicator& ranks) const = 0;

  /// How many pairs (or particles, for a field) of this rank one evaluation visits within reach: the unit of
  /// `force_passes`.
  virtual std::uint64_t interacting_pairs(Positions<D> x) const = 0;

  /// The constant acceleration, the same for every particle, that this term gives; null where it gives anything else.
  /// Free flight can carry such a field exactly.
  virtual const Vec<D>* common_acceleration() const { return nullptr; }

  /// What its cutoff takes away, estimated; of all particles, on each rank.
  virtual Tail tail() const { return {}; }

  /// The bonds it stands for, by ids, where it was made for all particles or a block; null where it has none.
  virtual const PairList* bonds() const { return nullptr; }

  /// How large its forces are where particles are so far apart on average [length]; a function of parameters and of
  /// this rank's particles.
  virtual ForceScale scale(double distance) const = 0;

  /// Takes these kernels instead of the widest of this machine. The sums are the same to the bit; fields have none.
  virtual void use(const PairKernels&) {}

  /// Whether the term is invariant under translation, so that it keeps the total momentum.
  virtual bool keeps_momentum() const { return true; }
};

/// What an interaction is made from, besides its own parameters. The box and particles outlive the interaction.
template <int D>
struct InteractionContext {
  const Box<D>& box;
  const Particles<D>& particles;
  const std::vector<std::string>& species;   ///< names, in the order of Particles::species
  bool placed = true;                        ///< whether positions are known; else only the parameters count
  std::size_t total = particles.size();      ///< how many there are on all ranks, where `particles` are a block of them
  Communicator* ranks = nullptr;             ///< these ranks; null: all particles are here
  std::shared_ptr<const BondTable> bonds{};  ///< of all terms of bonds; null: there are no such terms
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

/// Every type of interaction there is, in the order of the manual.
const std::vector<InteractionInfo>& interactions();

/// The one of that name; throws Error(Failure::deck), which lists the names.
const InteractionInfo& find_interaction(std::string_view name);

}  // namespace carom
