// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Divides the particles of a system among the ranks that advance it together.
//
// Every system has a decomposition. With one rank, the default, the rank owns everything and exchanges do nothing.
// Several ranks store particles in one of two ways:
//
// * in blocks of consecutive ids (id_blocks.h): at the start, between epochs of free flight, and for files;
// * by place, for methods with forces: one rank owns each particle, and the ranks near it have copies, the ghosts of
//   their halo (Particles::ghost), at least if they evaluate pairs with them. One of the two ranks that share a pair
//   evaluates it. The owner of a particle adds up the forces on it and on its ghosts, in integers, and sends the sum
//   back: it has the bits of a single rank. Cheap work is done by each rank for all particles that it has.
//
// If particles have cores, a rank advances its ghosts like its own particles. Ghosts at the rim of the halo lack
// partners and may become wrong, so the ranks check that the ghosts that matter had the same events as on their owners
// (engine/stepping/slab_core.h). If not, the slab is repeated with a larger halo (halo_width.h), finally with all
// particles on each rank. Before any particle has moved too far, particles migrate: each owner sends it, with its
// fields, to the ranks that need it (migration.h).

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/base/fields.h"
#include "engine/base/particles.h"
#include "engine/base/sizes.h"
#include "engine/laws/interaction.h"
#include "engine/ranks/communicator.h"
#include "engine/ranks/halo_exchange.h"
#include "engine/ranks/halo_width.h"
#include "engine/ranks/id_blocks.h"

namespace carom {

template <int D>
struct System;

/// Thrown on all ranks together, with the system unchanged: the particles of a rank did not suffice for a slab, because
/// a halo was too narrow or the work needs all particles. The slab must be repeated after enlarge_halo().
struct HaloTooSmall {};

template <int D>
class Decomposition {
 public:
  /// For this system, on one rank.
  explicit Decomposition(System<D>& system) : system_(system) {}
  Decomposition(const Decomposition&) = delete;
  Decomposition& operator=(const Decomposition&) = delete;

  // The ranks. The functions below are collective.

  /// Several ranks, each with all particles, advance the system from now on: this rank keeps its block.
  void join(Communicator& ranks);
  /// join() before particles exist: this rank creates the particles of its block.
  void join(Communicator& ranks, Sizes of_all);
  bool joined() const { return sizes_.has_value(); }
  /// The ranks; with one rank, a communicator of one.
  Communicator& ranks() const { return *ranks_; }
  /// Null if all particles are here.
  Communicator* others() const { return joined() ? ranks_ : nullptr; }
  double seconds_waited() const { return ranks_->seconds_waited(); }  ///< for other ranks [s]

  /// The number of particles on all ranks.
  std::size_t total() const;
  /// Radii and masses of all particles; requires several ranks.
  const Sizes& sizes() const { return *sizes_; }
  /// The radii of all particles, or one for each species [length].
  std::span<const double> radii() const;
  IdBlocks blocks() const { return {total(), static_cast<std::size_t>(ranks_->size())}; }

  /// The exact sum over all ranks.
  template <class Sums>
  Sums sum(const Sums& mine) const {
    return joined() ? sum_of_all(*ranks_, mine) : mine;
  }
  double largest(double value) const {
    ranks_->largest({&value, 1});
    return value;
  }
  bool any(bool value) const { return largest(value ? 1 : 0) > 0; }

  // Particles by place, for methods with forces.

  /// Divides the particles by place. `local`: a rank needs only its own and nearby particles for slabs of this length
  /// [time]; otherwise all ranks have all. `cores`: particles collide; if not, a rank lacks ghosts with which it
  /// evaluates no pairs, and the others get positions only. Returns false if there is only one rank.
  bool divide(bool local, double slab_length, bool cores = true);
  /// Call before a slab: divides again if that is due; returns whether it did.
  bool divide_if_due(std::int64_t slab, double slab_length);
  /// Call after HaloTooSmall: enlarges the halos if that can help, else gives all ranks all particles.
  void enlarge_halo(std::int64_t slab, double slab_length);
  /// Returns to blocks, with the interactions as they were before divide().
  void to_blocks();
  /// The present particles of this rank's block; with one rank, all.
  const Particles<D>& block();
  /// A field for the particles of this rank's block; with one rank, for all.
  Bytes block_of(Fields::Field& field) const;

  bool by_place() const { return layout_ != Layout::blocks; }
  /// Whether this rank has all particles, or its block.
  bool knows_all() const { return layout_ != Layout::halos; }
  /// For work that needs all particles on one rank: throws HaloTooSmall if some are missing.
  void need_all() const {
    if (!knows_all()) throw HaloTooSmall{};
  }
  /// Throws HaloTooSmall unless the halos suffice for a slab in which the longest path on any rank is `path` [length].
  void need_paths(double path);
  /// For a step of this length [time] in which own particles move to x at velocities v: between start_step() and
  /// finish_step() the positions of their owners travel to ghosts. finish_step() throws HaloTooSmall unless the halos
  /// suffice. If a list of pairs ages on any rank, all make new ones. With one rank they do nothing.
  void start_step(std::span<Vec<D>> x, std::span<const Vec<D>> v, double length);
  void finish_step(std::span<Vec<D>> x);
  /// Throws HaloTooSmall because ghosts that matter went wrong; the halo must be deeper.
  [[noreturn]] void need_deeper_halo();
  /// Whether the motion of a ghost matters to own particles.
  bool matters(Id i) const { return halo_.matters(i); }

  /// Ghosts get the values of their owners; each vector has an entry for each particle of this rank.
  template <class... T>
  void copy_to_ghosts(std::span<T>... values) const {
    if (by_place()) halo_.update(*ranks_, values...);
  }
  /// Adds forces on ghosts to those on the particles of their owners; call when all forces of a pass have been added.
  /// Returns whether the sums of all ranks have room for more passes. Collective.
  bool add_ghosts(ForceSums<D>& sums) const { return by_place() ? halo_.add_ghosts(*ranks_, sums) : sums.has_room(); }
  /// Ghosts get positions, velocities and spins of their owners, since some at the rim may be wrong. Does nothing if
  /// all ranks have all particles.
  void update_halo();

 private:
  void migrate(double slab_length);
  bool migrate_to_near(double slab_length);
  double squared_farthest(std::span<const Vec<D>> x) const {
    return halo_.squared_farthest(system_.box, system_.particles, x);
  }
  void migrate_to_all();
  std::vector<std::uint32_t> work() const;
  bool uneven() const;
  std::vector<Bytes> pack(const std::vector<std::uint64_t>& particles, auto&& for_each_receiver,
                          std::vector<Fields::Arrival>* stay = nullptr);
  void assign(const Bisection<D>& bisection, double near, bool one_sided = false);

  System<D>& system_;
  Communicator alone_;
  Communicator* ranks_ = &alone_;
  std::optional<Sizes> sizes_;

  /// What a rank has: its block; by place, its own particles and a halo; by place, all particles.
  enum class Layout { blocks, halos, copies_of_all };

  Layout layout_ = Layout::blocks;
  Particles<D> block_;                                               // by place, only constant fields are up to date
  std::vector<std::unique_ptr<Interaction<D>>> block_interactions_;  // for the block, by place
  bool local_ = false;                                               // halos may be enough
  bool points_ = false;                                              // particles do not collide
  bool fresh_ = false;                                               // no slab has been done since divide()
  HaloWidth width_;
  HaloExchange<D> halo_;
  std::optional<double> farthest_;  // the largest squared displacement at the end of the last step, if it was needed
  std::vector<double> most_;        // of a step: longest path, largest squared displacement, which terms age
  std::int64_t next_ = 0;           // with copies of all: the slab before which to divide again
  std::int64_t slabs_with_all_ = 1;
};

}  // namespace carom
