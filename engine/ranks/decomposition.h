// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// How the particles of a system are divided among the ranks that advance it together.
//
// It is always there. With one rank, the default, it owns everything and its exchanges do nothing. Several ranks keep
// particles in one of two ways:
//
// * in blocks of consecutive ids (id_blocks.h): at the start, between epochs of free flight, and for files;
// * by place, under forces: every particle is owned by one rank, and the ranks near it have copies, their halo
//   (Particles::ghost). What acts on a particle is computed by its owner, with all its pairs, in sums of integers, and
//   sent to the others: the sums are those of one rank alone, bit for bit. What is cheap beside that each rank does for
//   all particles that it knows.
//
// A rank flies its copies like its own particles; those at the rim of the halo may go wrong, for they miss partners, so
// it is checked that those near enough to matter did what they did at their owners (engine/slabs/slab_core.h). If they
// did not, the slab is done again with a larger halo (halo_width.h), in the end with all particles known. Particles
// migrate before one has come too far: each goes from its owner to the ranks that know it from then on, with its fields
// (migration.h).

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/base/fields.h"
#include "engine/base/interaction.h"
#include "engine/base/particles.h"
#include "engine/base/sizes.h"
#include "engine/ranks/communicator.h"
#include "engine/ranks/halo_exchange.h"
#include "engine/ranks/halo_width.h"
#include "engine/ranks/id_blocks.h"

namespace carom {

template <int D>
struct System;

/// Thrown on all ranks together, before anything of the system has changed: the particles that they know were not
/// enough for a slab, which is to be done again after enlarge_halo().
struct HaloTooSmall {};

template <int D>
class Decomposition {
 public:
  /// Of this system, by one rank.
  explicit Decomposition(System<D>& system) : system_(system) {}
  Decomposition(const Decomposition&) = delete;
  Decomposition& operator=(const Decomposition&) = delete;

  // The ranks. What follows is collective.

  /// Several ranks, each of which has made all particles, advance the system from now on: this one keeps its block.
  void join(Communicator& ranks);
  /// The same before there are particles: this rank makes those of its block.
  void join(Communicator& ranks, Sizes of_all);
  bool joined() const { return sizes_.has_value(); }
  /// Of one rank too.
  Communicator& ranks() const { return *ranks_; }
  /// Null: all particles are here.
  Communicator* others() const { return joined() ? ranks_.get() : nullptr; }
  double seconds_waited() const { return ranks_->seconds(); }  ///< for other ranks

  /// How many particles all ranks have together.
  std::size_t total() const;
  /// Radii and masses of all particles, once several ranks have joined.
  const Sizes& sizes() const { return *sizes_; }
  /// Of all particles, or one of each species [length].
  std::span<const double> radii() const;
  IdBlocks blocks() const { return {total(), static_cast<std::size_t>(ranks_->size())}; }

  /// What each rank has summed up over what it owns; exact.
  template <class Sums>
  Sums sum(const Sums& mine) const {
    return joined() ? sum_of_all(*ranks_, mine) : mine;
  }
  double largest(double value) const {
    ranks_->largest({&value, 1});
    return value;
  }
  bool any(bool value) const { return largest(value ? 1 : 0) > 0; }

  // Particles by place, for work on forces.

  /// Divides the particles by place. `local`: a rank's own particles and those near them are enough for slabs of this
  /// length [time], else all ranks know all. `cores`: particles collide. Returns whether there is anything to divide.
  bool divide(bool local, double slab_length, bool cores = true);
  /// Before a slab: divides anew if it is time for that; returns whether it was.
  bool divide_if_due(std::int64_t slab, double slab_length);
  /// After HaloTooSmall: knows more particles, where that was what lacked, or all.
  void enlarge_halo(std::int64_t slab, double slab_length);
  /// Back to blocks, with the interactions as they were before divide().
  void to_blocks();
  /// The particles of this rank's block as they are now; one rank: all.
  const Particles<D>& block();
  /// A field of particles, for those of this rank's block; one rank: all.
  Bytes block_of(Fields::Field& field) const;

  bool by_place() const { return by_place_; }
  bool knows_all() const { return !by_place_ || all_known_; }
  /// For what only a rank that knows all particles can do: throws HaloTooSmall.
  void need_all() const {
    if (!knows_all()) throw HaloTooSmall{};
  }
  /// Throws HaloTooSmall unless the particles that are known are enough for paths so long in a slab, those of all
  /// ranks [length].
  void need_paths(double path);
  /// The same for a step of a kick-drift-kick method.
  void need_step(std::span<const Vec<D>> a, double length);
  /// Copies went wrong that matter: throws HaloTooSmall; the halo is to be deeper.
  [[noreturn]] void need_deeper_halo();
  /// Whether what a copy does matters to own particles.
  bool matters(Id i) const { return halo_.matters(i); }

  /// Copies get the values of their owners; each vector has an entry for each particle known.
  template <class... T>
  void update(std::span<T>... values) const {
    if (by_place_) halo_.update(*ranks_, values...);
  }
  /// Positions and velocities of copies, which may have gone wrong at the rim. All particles known: none have.
  void update_halo();

 private:
  void migrate(bool all, double slab_length);
  bool migrate_to_those_near(double slab_length);
  void migrate_to_all();
  void own_anew();
  std::vector<Bytes> pack(const std::vector<std::uint64_t>& particles, auto&& for_each_receiver);
  void assign(const Bisection<D>& bisection, double near);

  System<D>& system_;
  Communicator alone_;
  std::unique_ptr<TimedCommunicator> ranks_ = std::make_unique<TimedCommunicator>(alone_);
  std::optional<Sizes> sizes_;

  bool by_place_ = false;
  Particles<D> block_;                                               // by_place_: what does not change is up to date
  std::vector<std::unique_ptr<Interaction<D>>> block_interactions_;  // by_place_: made for the block
  bool local_ = false, all_known_ = false;
  HaloWidth width_;
  HaloExchange<D> halo_;
  std::int64_t next_ = 0;  // while all are known: the slab before which to divide
  std::int64_t slabs_with_all_ = 1;
};

}  // namespace carom
